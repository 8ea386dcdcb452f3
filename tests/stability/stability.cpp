/// The stability study judges soundly, and its quick scenes keep their promises. The whole table:
/// `talus study stability`, docs/stability.md.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "apps/stability_run.hpp"

namespace talus::stability {
namespace {

std::vector<Scene> named(const std::string& part) {
  std::vector<Scene> all = scenes();
  std::erase_if(all, [&](const Scene& scene) { return scene.name.find(part) == std::string::npos; });
  EXPECT_FALSE(all.empty()) << part;
  return all;
}

void expect_all(const std::string& part, const std::set<Verdict>& allowed) {
  for (const Scene& scene : named(part)) {
    const Outcome outcome = run_scene(scene, {});
    EXPECT_TRUE(allowed.contains(outcome.verdict))
        << scene.name << ": " << name_of(outcome.verdict) << ", true error " << outcome.true_error
        << ", certificate " << std::max(outcome.error_rms, outcome.balance) << "; " << outcome.why.data();
  }
}

/// One grain on the floor with a truth of one's own.
Scene resting(Truth truth) {
  Scene scene = named("rest").front();
  scene.build = [build = scene.build, truth = std::move(truth)] {
    Problem made = build();
    made.truth = truth;
    return made;
  };
  return scene;
}

TEST(StabilityVerdict, IsWrongWhereACertifiedStepIsFarFromTheTruth) {
  for (double error : {0.5, std::numeric_limits<double>::quiet_NaN()}) {
    const Outcome outcome = run_scene(resting([=](const StepView&) { return error; }), {});
    EXPECT_EQ(outcome.verdict, Verdict::wrong) << error;
    EXPECT_EQ(outcome.steps, 1);
  }
  EXPECT_EQ(run_scene(resting([](const StepView&) { return 1e-3; }), {}).verdict, Verdict::right);
}

TEST(StabilityVerdict, IsHonestWhereAFalseStepSaysThatItMissed) {
  Scene scene = named("column-10").front();
  scene.build = [build = scene.build] {
    Problem made = build();
    made.truth = [](const StepView&) { return 0.5; };
    made.setup.solver.max_iterations = 1;
    return made;
  };
  const Outcome outcome = run_scene(scene, {});
  EXPECT_EQ(outcome.verdict, Verdict::honest);
  EXPECT_GT(outcome.missed, 0);
}

TEST(StabilityVerdict, OfASceneWithoutTruthIsNoMoreThanCertified) {
  EXPECT_EQ(run_scene(resting(nullptr), {}).verdict, Verdict::certified);
}

TEST(StabilityVerdict, OfASceneThatTakesTooLongSaysSo) {
  const Outcome outcome = run_scene(resting(nullptr), {.seconds = 0});
  EXPECT_EQ(outcome.verdict, Verdict::honest);
  EXPECT_EQ(outcome.steps, 1);
  EXPECT_NE(std::string(outcome.why.data()).find("stopped after"), std::string::npos);
}

TEST(StabilityVerdict, OfASceneThatCrashesIsARowLikeAnyOther) {
  Scene scene = resting(nullptr);
  EXPECT_EQ(run_scene_apart(scene, {}).verdict, Verdict::certified);
  scene.build = []() -> Problem {
    std::raise(SIGKILL);
    return {};
  };
  const Outcome outcome = run_scene_apart(scene, {});
  EXPECT_EQ(outcome.verdict, Verdict::failed);
  EXPECT_NE(std::string(outcome.why.data()).find("signal 9"), std::string::npos) << outcome.why.data();
}

TEST(StabilityScenes, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const Scene& scene : scenes()) EXPECT_TRUE(names.insert(scene.name).second) << scene.name;
  EXPECT_GE(names.size(), 30u);
}

TEST(StabilityScenes, ForcesOfAColumnOfAHundredAreRightAtAnyTimeStepAndFriction) {
  expect_all("column-100-", {Verdict::right});
  expect_all("friction-column", {Verdict::right});
  expect_all("time-step-column", {Verdict::right});
}

// The highest asks for more than the time step can give, and is told so.
TEST(StabilityScenes, EnergyOfBodiesThatStandInSeveralSubdomainsIsCountedOnce) {
  // A column that falls into its contacts loses what it has; copies whose masses were added up would gain.
  const Outcome outcome = run_scene(named("column-100-subdomains-8").front(), {});
  EXPECT_EQ(outcome.verdict, Verdict::right);
  EXPECT_LT(outcome.energy_gained, 1e-9);
}

TEST(StabilityScenes, PressureOverTwelveDecadesIsCarriedOrRefused) {
  for (const char* part : {"pressure-1e-", "pressure-1e+00", "pressure-1e+03", "pressure-1e+06"})
    expect_all(part, {Verdict::right});
  expect_all("pressure-1e+09", {Verdict::right, Verdict::refused});
}

TEST(StabilityScenes, HeavyPlatesOnColumnsAreCarriedOrNotCertified) {
  for (const char* part : {"plate-columns-1e+02", "plate-columns-1e+04", "plate-columns-1e+06"})
    expect_all(part, {Verdict::right, Verdict::honest});
}

TEST(StabilityScenes, WedgesArchesAndCornersCarryTheirForces) {
  for (const char* part : {"wedge-jammed", "walls-corner", "walls-funnel", "arch-"})
    expect_all(part, {Verdict::right});
  expect_all("wedge-0", {Verdict::right, Verdict::honest});
}

TEST(StabilityScenes, SingleGrainsMoveAsTheClosedFormsSay) {
  for (const char* part : {"one-body", "no-gravity", "spin-", "skid", "slope-", "impact-", "gas-"})
    expect_all(part, {Verdict::right});
}

TEST(StabilityScenes, NothingThatPassesThroughAnotherIsCertified) {
  expect_all("fast-", {Verdict::honest});
  expect_all("walls-cross", {Verdict::refused});
}

TEST(StabilityScenes, OverlapsAtTheStartDoNotBlowUpSilently) {
  expect_all("overlap-", {Verdict::right, Verdict::certified, Verdict::refused});
}

TEST(StabilityScenes, TheAnswerScalesWithTheUnits) {
  expect_all("units-", {Verdict::right});
}

TEST(StabilityScenes, NonsenseIsRefused) {
  expect_all("nonsense-", {Verdict::refused});
}

}  // namespace
}  // namespace talus::stability
