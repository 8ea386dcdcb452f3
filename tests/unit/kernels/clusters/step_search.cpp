// What a search by proximal steps makes of what these do, shown by steps that follow a script.

#include "kernels/clusters/step_search.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::step_search_test {
namespace {

using namespace cluster_makers;

constexpr double mu = 0.3;

BodyProblem grain_on_floor() {
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), mu);
  add_contact(problem, grain, -1, Vec3::UnitZ(), mu, 0);
  return problem;
}

/// Steps with friction, the k-th of which moves the grain by `moves[k]` and leaves `open[k]` of the law; the
/// last go on for ever.
struct Script {
  std::vector<double> moves, open;  ///< [m/s], [N s]
  bool leaps = false;               ///< impulses may go on
  bool solves = true;
  std::vector<double> firmness = {};       ///< of the steps that were asked for
  std::vector<int> leapt = {};             ///< steps behind which it has leapt
  mutable std::vector<int> foreseen = {};  ///< steps behind which it was asked what is to come
  int taken = 0;                           ///< steps
  double height = 0;                       ///< [m/s]

  std::vector<Twist> motion() const { return {{Vec3(0, 0, height), Vec3::Zero()}}; }
  bool solve(const StepStart& start, double& work) {
    work -= 1;
    firmness.push_back(start.firmness);
    if (solves) height += of(moves);
    return solves;
  }
  Correction take() {
    ++taken;
    Correction now;
    now.motion = motion();
    now.impulse = {Vec3(0, 0, height)};
    now.found = height;
    now.open = of(open, 1);
    return now;
  }
  std::optional<double> to_come(const Correction&, double, const ClusterGoal&, double&) const {
    foreseen.push_back(taken);
    return {};
  }
  bool creep_on() {
    if (leaps) leapt.push_back(taken);
    return leaps;
  }
  bool firmer(bool) const { return true; }

  double of(const std::vector<double>& list, int back = 0) const {
    const auto k = static_cast<std::size_t>(taken - back);
    return list[k < list.size() ? k : list.size() - 1];
  }
};

constexpr SearchThresholds search{.first_firmness = 1e9, .most_steps = 100};

StepsCorrection searched(Script& script, const SearchThresholds& thresholds = search) {
  double work = 1e9;
  return search_by_steps(grain_on_floor(), {.enough = enough, .relative = 1e-3}, {}, thresholds, script,
                         work);
}

TEST(StepSearch, SettlesWhereTheLastTwoStepsTellThatNextToNothingIsToCome) {
  constexpr double little = 1e-5 * enough;
  Script script{.moves = {fall, 8 * little, little}, .open = {fall, little}};
  const StepsCorrection answer = searched(script);
  ASSERT_TRUE(answer.best.settled);
  EXPECT_FALSE(answer.stuck);
  EXPECT_LE(script.firmness.size(), 3U);
}

/// The law is as wrong as before, and nobody moves: the search gives up after SearchThresholds::idle steps.
TEST(StepSearch, EndsWhereNothingMovesOrMends) {
  Script script{.moves = {fall, 0}, .open = {fall}};
  const StepsCorrection answer = searched(script);
  EXPECT_TRUE(answer.stuck);
  EXPECT_FALSE(answer.best.settled);
  EXPECT_NEAR(static_cast<double>(script.firmness.size()), search.idle, 3);
}

/// What moved little behind a leap would pass for an answer, and of a leap no ratio of two steps tells.
TEST(StepSearch, TakesWhatFollowsALeapForNoComparison) {
  Script script{.moves = {fall, 0}, .open = {fall}, .leaps = true};
  searched(script);
  ASSERT_GE(script.leapt.size(), 2U) << "behind idle steps, again and again";
  for (const int step : script.leapt)
    for (const int asked : script.foreseen)
      EXPECT_NE(asked, step + 1) << "what is to come is not known there";
  EXPECT_EQ(script.leapt[1] - script.leapt[0], search.idle_before_leap)
      << "idle steps are counted anew behind a leap";
}

/// The step behind the first leap leaves nothing wrong, but only the one behind that tells that it lasts.
TEST(StepSearch, AsksForOneMoreStepBehindALeap) {
  constexpr double little = 1e-5 * enough;
  Script script{.moves = {fall, 0, 0, 0, little}, .open = {fall, fall, fall, little}, .leaps = true};
  const StepsCorrection answer = searched(script);
  ASSERT_FALSE(script.leapt.empty());
  ASSERT_TRUE(answer.best.settled);
  EXPECT_GE(static_cast<int>(script.firmness.size()), script.leapt.back() + 2);
}

/// By SearchThresholds::growth each time, down to SearchThresholds::least_firmness.
TEST(StepSearch, TriesStepsThatAreNotSolvedSofterAndEndsBelowTheSoftest) {
  Script script{.moves = {0}, .open = {fall}, .solves = false};
  SearchThresholds few = search;
  few.first_firmness = 30;
  EXPECT_FALSE(searched(script, few).best.settled);
  EXPECT_EQ(script.firmness, (std::vector<double>{30, 6, 1.2}));
}

}  // namespace
}  // namespace talus::step_search_test
