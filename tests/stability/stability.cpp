/// The stability study judges soundly, and every scene of its table comes out as the table says:
/// `talus study stability`, docs/stability.md.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "apps/shared/exit_codes.hpp"
#include "apps/study_stability/stability_run.hpp"

namespace talus::stability {

/// Of a failed test.
void PrintTo(const Scene& scene, std::ostream* out) {
  *out << scene.name;
}

namespace {

Scene named(const std::string& name) {
  for (Scene& scene : scenes())
    if (scene.name == name) return std::move(scene);
  ADD_FAILURE() << "no scene " << name;
  return {};
}

/// The scene with something in it changed.
Scene changed(const std::string& name, const std::function<void(Problem&)>& change) {
  Scene scene = named(name);
  scene.build = [build = scene.build, change] {
    Problem made = build();
    change(made);
    return made;
  };
  return scene;
}

using Error = std::function<std::optional<double>(const StepView&)>;

/// One grain on the floor with a truth of one's own.
Scene resting(const Truth& truth) {
  return changed("rest", [=](Problem& made) { made.truth = truth; });
}

Scene resting(const Error& error) {
  return resting(Truth{error});
}

std::string why(const Outcome& outcome) {
  return outcome.why.data();
}

double certificate(const Outcome& outcome) {
  return std::max(outcome.error_rms, outcome.balance);
}

TEST(StabilityVerdict, IsWrongWhereACertifiedStepIsFarFromTheTruth) {
  for (double error : {0.5, std::numeric_limits<double>::quiet_NaN()}) {
    const Outcome outcome = run_scene(resting([=](const StepView&) { return error; }), {});
    EXPECT_EQ(outcome.verdict, Verdict::wrong) << error;
    EXPECT_EQ(outcome.steps, 1);
  }
  const Outcome near = run_scene(resting([](const StepView&) { return 1e-3; }), {});
  EXPECT_EQ(near.verdict, Verdict::right);
  EXPECT_EQ(near.judged, near.steps);
}

TEST(StabilityVerdict, IsRightOnlyWhereEveryStepHasATruth) {
  const Error first = [](const StepView& step) {
    return step.after.step == 1 ? std::optional<double>(0) : std::nullopt;
  };
  const Outcome outcome = run_scene(resting(Truth{first, TruthFrom::any_state, "the rest is silence"}), {});
  EXPECT_EQ(outcome.verdict, Verdict::certified);
  EXPECT_EQ(outcome.judged, 1);
  EXPECT_EQ(outcome.steps, 20);
  EXPECT_EQ(why(outcome), "1 of 20 steps judged: the rest is silence");
}

TEST(StabilityVerdict, IsNotRightWhereEnergyComesFromNowhere) {
  // Light grains under a plate of 10^8 their mass keep some of its energy and next to nothing of its
  // momentum.
  const Outcome outcome = run_scene(changed("plate-columns-1e+08",
                                            [](Problem& made) {
                                              made.truth = {[](const StepView&) { return 0.0; }};
                                              made.steps = 1;
                                              made.setup.solver.method = SolverMethod::admm;
                                              made.setup.solver.tolerance = 1e-5;
                                              made.setup.solver.velocity_tolerance = 1e3;
                                            }),
                                    {});
  ASSERT_GT(outcome.energy_gained, 2 * std::max(certificate(outcome), 1e-5));
  EXPECT_EQ(outcome.judged, 1);
  EXPECT_EQ(outcome.verdict, Verdict::certified);
  EXPECT_NE(why(outcome).find("of energy"), std::string::npos) << why(outcome);
}

TEST(StabilityVerdict, KnowsASpinThatIsWrong) {
  // It slides all the way, so that its inertia tells in nothing but its spin.
  const Outcome outcome =
      run_scene(changed("skid", [](Problem& made) { made.bodies.velocity[0].spin_mobility *= 1.01; }), {});
  EXPECT_EQ(outcome.verdict, Verdict::wrong);
}

/// A column whose second step is beyond its certificate by as much as it begins with in motion.
Verdict of_a_step_that_begins_in_motion(TruthFrom from) {
  const Error error = [](const StepView& step) {
    const StepReport& report = step.simulation.report();
    double speed = 0, gained = 0;
    for (const Vec3& u : step.before.u) {
      speed += u.norm();
      gained += step.time_step() * step.gravity().norm();
    }
    EXPECT_TRUE(report.step != 2 || speed > 1e-2 * gained);
    return report.step == 2 ? 2 * std::max(report.error_rms, report.balance) + speed / gained : 0.0;
  };
  return run_scene(changed("column-10", [&](Problem& made) { made.truth = {error, from}; }), {}).verdict;
}

TEST(StabilityVerdict, OfSamplesAtRestAloneHasRoomForWhatAStepBeginsWithInMotion) {
  EXPECT_EQ(of_a_step_that_begins_in_motion(TruthFrom::rest), Verdict::right);
  EXPECT_EQ(of_a_step_that_begins_in_motion(TruthFrom::certified), Verdict::wrong);
  EXPECT_EQ(of_a_step_that_begins_in_motion(TruthFrom::any_state), Verdict::wrong);
}

TEST(StabilityVerdict, IsHonestWhereAFalseStepSaysThatItMissed) {
  const Outcome outcome = run_scene(changed("column-10",
                                            [](Problem& made) {
                                              made.truth = {[](const StepView&) { return 0.5; }};
                                              // `auto` would put so few grains right by itself
                                              made.setup.solver.method = SolverMethod::nlgs;
                                              made.setup.solver.max_iterations = 1;
                                            }),
                                    {});
  EXPECT_EQ(outcome.verdict, Verdict::honest);
  EXPECT_GT(outcome.missed, 0);
  EXPECT_EQ(outcome.judged, 0);
}

TEST(StabilityVerdict, KeepsTheErrorThatIsKnownOfAStepThatMissed) {
  // No truth holds behind that step.
  const Outcome outcome = run_scene(named("fast-wall-5"), {});
  ASSERT_EQ(outcome.verdict, Verdict::honest);
  ASSERT_GE(outcome.missed, 1);
  EXPECT_GT(outcome.true_error, 0.1);
}

TEST(StabilityVerdict, OfASceneWithoutTruthIsNoMoreThanCertified) {
  const Outcome outcome = run_scene(resting(Truth{}), {});
  EXPECT_EQ(outcome.verdict, Verdict::certified);
  EXPECT_EQ(outcome.judged, 0);
}

TEST(StabilityVerdict, AReferenceThatFallsShortIsNoTruth) {
  const Problem made = named("walls-crush").build();  // nothing solves it
  graph::Executor executor({.threads = 1});
  Simulation simulation(made.setup, made.bodies, executor);
  const Frame before = simulation.frame(false);
  const std::optional<SavedState> start = simulation.save();
  simulation.step();
  EXPECT_FALSE(reference_velocities().error({simulation, start, before, simulation.frame()}).has_value());
}

TEST(StabilityVerdict, OfASceneThatTakesTooLongSaysSo) {
  const Outcome outcome = run_scene(resting(Truth{}), {.seconds = 0});
  EXPECT_EQ(outcome.verdict, Verdict::honest);
  EXPECT_EQ(outcome.steps, 1);
  EXPECT_NE(why(outcome).find("stopped after"), std::string::npos);
}

TEST(StabilityVerdict, OfASceneThatCrashesIsARowLikeAnyOther) {
  Scene scene = resting(Truth{});
  EXPECT_EQ(run_scene_apart(scene, {}).verdict, Verdict::certified);
  scene.build = []() -> Problem {
    std::raise(SIGKILL);
    return {};
  };
  const Outcome outcome = run_scene_apart(scene, {});
  EXPECT_EQ(outcome.verdict, Verdict::failed);
  EXPECT_NE(why(outcome).find("signal 9"), std::string::npos) << why(outcome);
}

TEST(StabilityVerdict, IsHeldAgainstTheTableWithItsOwnSettingsOnly) {
  const Scene scene = named("rest");
  ASSERT_EQ(scene.expected, Verdicts{Verdict::right});
  Outcome outcome;
  outcome.verdict = Verdict::honest;
  EXPECT_FALSE(as_expected(scene, outcome, {}));
  EXPECT_TRUE(as_expected(scene, outcome, {.method = SolverMethod::nlgs}));
  EXPECT_TRUE(as_expected(scene, outcome, {.tolerance = 1e-6}));
  outcome.verdict = Verdict::wrong;
  EXPECT_FALSE(as_expected(scene, outcome, {.tolerance = 1e-6}));
}

class StabilityCommand : public testing::Test {
 protected:
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("talus_stability_" + std::to_string(::getpid()));
  std::string output_;  ///< of both streams

  ~StabilityCommand() override { std::filesystem::remove_all(folder_); }

  /// Returns the exit code.
  int study(const std::string& arguments) {
    const std::string line =
        TALUS_COMMAND " study stability " + arguments + " --force --out " + folder_.string() + " 2>&1";
    std::FILE* pipe = ::popen(line.c_str(), "r");
    std::array<char, 256> buffer;
    output_.clear();
    while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) output_ += buffer.data();
    const int status = ::pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string file(const char* name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }
};

TEST_F(StabilityCommand, EndsWellWhereAllRowsAreAsExpected) {
  EXPECT_EQ(study("--only no-body --only nonsense-wall"), exit_done) << output_;
  EXPECT_EQ(output_.find("EXPECTED"), std::string::npos) << output_;
}

TEST_F(StabilityCommand, EndsInFailureAndNamesARowThatIsHonestWhereItShouldBeRight) {
  EXPECT_EQ(study("--only skid --only no-body --seconds 1e-9"), exit_failure);
  EXPECT_NE(output_.find("scene 'skid' is honest"), std::string::npos) << output_;
  EXPECT_NE(output_.find("EXPECTED: right"), std::string::npos) << output_;
}

TEST_F(StabilityCommand, ShowsHowManyStepsWereJudgedInTableFileAndPage) {
  ASSERT_EQ(study("--only no-body --only impact-1e+00-restitution-1"), exit_done) << output_;
  const std::string csv = file("stability.csv"), page = file("stability.html");
  EXPECT_NE(csv.find("steps,judged,missed"), std::string::npos) << csv;
  for (const char* share : {"0/3", "3/3"}) {
    EXPECT_NE(output_.find(share), std::string::npos) << share;
    EXPECT_NE(page.find(share), std::string::npos) << share;
  }
}

class StabilityTable : public testing::TestWithParam<Scene> {};

TEST_P(StabilityTable, ComesOutAsExpected) {
  const Scene& scene = GetParam();
  const Outcome outcome = run_scene(scene, {});
  EXPECT_TRUE(as_expected(scene, outcome, {}))
      << scene.name << " (" << scene.asks << "): " << name_of(outcome.verdict) << ", true error "
      << outcome.true_error << ", certificate " << certificate(outcome) << ", " << outcome.judged << " of "
      << outcome.steps << " steps judged; " << why(outcome);
}

/// Of rows that take a second and less.
TEST(StabilityScenes, AreNotWrongByOtherTolerances) {
  const std::array<std::string, 3> dear = {"column-1000", "row-1000", "pressure-"};
  for (const Scene& scene : scenes()) {
    const auto begins = [&](const std::string& name) { return scene.name.starts_with(name); };
    if (std::any_of(dear.begin(), dear.end(), begins)) continue;
    for (double tolerance : {1e-2, 1e-5}) {
      const RunSettings settings{.tolerance = tolerance};
      const Outcome outcome = run_scene(scene, settings);
      EXPECT_TRUE(as_expected(scene, outcome, settings))
          << scene.name << " at " << tolerance << ": " << name_of(outcome.verdict) << "; " << why(outcome);
    }
  }
}

/// gtest takes letters, digits and underscores.
std::string test_name(const testing::TestParamInfo<Scene>& info) {
  std::string name;
  for (char c : info.param.name) {
    if (c == '+')
      name += "plus";
    else
      name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, StabilityTable, testing::ValuesIn(scenes()), test_name);

TEST(StabilityScenes, AreAllTested) {
  const testing::UnitTest& tests = *testing::UnitTest::GetInstance();
  std::set<std::string> tested, table;
  for (int s = 0; s < tests.total_test_suite_count(); ++s) {
    const testing::TestSuite& suite = *tests.GetTestSuite(s);
    if (std::string(suite.name()) != "All/StabilityTable") continue;
    for (int t = 0; t < suite.total_test_count(); ++t) tested.insert(suite.GetTestInfo(t)->value_param());
  }
  for (const Scene& scene : scenes()) EXPECT_TRUE(table.insert(scene.name).second) << scene.name << " twice";
  EXPECT_EQ(tested, table);
  EXPECT_GE(table.size(), 115u);
}

TEST(StabilityScenes, ExpectNothingThatIsWrong) {
  for (const Scene& scene : scenes()) {
    EXPECT_FALSE(scene.expected.empty()) << scene.name;
    for (Verdict verdict : scene.expected)
      EXPECT_TRUE(verdict != Verdict::wrong && verdict != Verdict::failed) << scene.name;
  }
}

TEST(StabilityScenes, EnergyOfBodiesThatStandInSeveralSubdomainsIsCountedOnce) {
  // A column that falls into its contacts loses what it has; copies whose masses were added up would gain.
  const Outcome outcome = run_scene(named("column-100-subdomains-8"), {});
  EXPECT_EQ(outcome.verdict, Verdict::right);
  EXPECT_LT(outcome.energy_gained, 1e-9);
}

}  // namespace
}  // namespace talus::stability
