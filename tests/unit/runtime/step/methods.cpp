// How methods go on, and when they call ADMM.

#include "runtime/step/methods/method.hpp"

#include <gtest/gtest.h>

#include <string>

namespace talus {
namespace {

constexpr auto plain = SweepKind::plain, conjugate = SweepKind::conjugate;

std::unique_ptr<Method> made(SolverMethod method, bool friction = true, bool schwarz = false) {
  static const SolverSettings settings;
  return methods().of(method).make({settings, friction, schwarz});
}

TEST(Methods, EveryMethodCanBeMadeAndThoseThatCodeAsksForAreRegistered) {
  for (const auto& entry : methods()) EXPECT_NE(made(entry.kind), nullptr) << entry.name;
  for (const auto method : {SolverMethod::automatic, SolverMethod::nlgs, SolverMethod::momentum,
                            SolverMethod::nncg, SolverMethod::admm})
    EXPECT_NO_THROW(methods().of(method));
}

TEST(Methods, BeginWithTheirOwnSweeps) {
  EXPECT_EQ(made(SolverMethod::nlgs)->begin().kind, plain);
  EXPECT_EQ(made(SolverMethod::momentum)->begin().kind, SweepKind::momentum);
  EXPECT_EQ(made(SolverMethod::nncg)->begin().kind, conjugate);
  EXPECT_EQ(made(SolverMethod::admm)->begin().kind, plain);
  EXPECT_EQ(made(SolverMethod::automatic)->begin().kind, SweepKind::momentum);
  EXPECT_EQ(made(SolverMethod::automatic, true, true)->begin().kind, plain) << "Schwarz is no descent";
  EXPECT_NEAR(made(SolverMethod::momentum)->begin().most, 0.92, 1e-12);
  EXPECT_NEAR(made(SolverMethod::momentum, false)->begin().most, 0.9, 1e-12);
}

TEST(Methods, GoOnAsAnErrorThatGrowsAsks) {
  struct Row {
    SolverMethod method;
    SweepPlan now;
    double growth;
    std::optional<SweepPlan> next;
  };
  constexpr auto automatic = SolverMethod::automatic;
  const Row table[] = {
      {SolverMethod::nlgs, {plain, 0}, 9, {}},
      {SolverMethod::momentum, {SweepKind::momentum, 0.92}, 0.9, {}},
      {SolverMethod::momentum, {SweepKind::momentum, 0.92}, 1.1, SweepPlan{SweepKind::momentum, 0.84}},
      {SolverMethod::momentum, {SweepKind::momentum, 0.4}, 1.1, SweepPlan{}},
      {SolverMethod::momentum, {SweepKind::momentum, 0.92}, 4, SweepPlan{}},
      {SolverMethod::nncg, {conjugate, 0}, 3.9, {}},
      {SolverMethod::nncg, {conjugate, 0}, 4.1, SweepPlan{}},
      {SolverMethod::admm, {plain, 0}, 9, {}},
      {automatic, {SweepKind::momentum, 0.96}, 1.1, SweepPlan{SweepKind::momentum, 0.92}},
      {automatic, {SweepKind::momentum, 0.92}, 1.1, SweepPlan{conjugate, 0}},
      {automatic, {SweepKind::momentum, 0.92}, 4, SweepPlan{}},
      {automatic, {conjugate, 0}, 4.1, SweepPlan{}},
      {automatic, {plain, 0}, 9, {}},
      {automatic, {plain, 0.92}, 0.5, SweepPlan{SweepKind::momentum, 0.92}},
  };
  for (const Row& row : table) {
    const auto next = made(row.method)->after_check(row.now, row.growth);
    const std::string what =
        std::string(methods().of(row.method).name) + " at growth " + std::to_string(row.growth);
    ASSERT_EQ(next.has_value(), row.next.has_value()) << what;
    if (!next) continue;
    EXPECT_EQ(next->kind, row.next->kind) << what;
    EXPECT_NEAR(next->most, row.next->most, 1e-12) << what;
  }
}

TEST(Methods, OnlyAutomaticHasAnotherWayThanToStagnate) {
  const SweepPlan now{SweepKind::momentum, 0.9};
  EXPECT_FALSE(made(SolverMethod::momentum)->after_stagnation(now));
  EXPECT_FALSE(made(SolverMethod::automatic)->after_stagnation({plain, 0}));
  const auto next = made(SolverMethod::automatic)->after_stagnation(now);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->kind, plain);
  EXPECT_EQ(next->most, 0);
}

TEST(Methods, AutomaticTakesMomentumUpAgainBehindAdmm) {
  const auto method = made(SolverMethod::automatic);
  const SweepPlan behind = method->after_admm({SweepKind::momentum, 0.9});
  EXPECT_EQ(behind.kind, plain);
  const auto next = method->after_check(behind, 1);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->kind, SweepKind::momentum);
  EXPECT_EQ(next->most, 0.9);
}

struct KnownView : MethodView {
  int since = 0, calls = 0;
  double needed = 0;
  bool checks = false, balance = false;
  int sweeps_since_start() const override { return since; }
  int admm_calls() const override { return calls; }
  double sweeps_needed() override { return needed; }
  bool checks_velocities() override { return checks; }
  bool balanced() override { return balance; }
};

KnownView view(int since, int calls, double needed, bool checks = false, bool balance = false) {
  KnownView made;
  made.since = since;
  made.calls = calls;
  made.needed = needed;
  made.checks = checks;
  made.balance = balance;
  return made;
}

bool calls(SolverMethod method, KnownView of) {
  return made(method)->calls_admm(of);
}

TEST(Methods, SweepsAloneNeverCallAdmm) {
  for (const auto method : {SolverMethod::nlgs, SolverMethod::momentum, SolverMethod::nncg})
    EXPECT_FALSE(calls(method, view(5000, 0, 1e6, true)));
}

TEST(Methods, AdmmIsCalledAtOnceAndAgainEverLaterAsLongAsForcesAreOutOfBalance) {
  const auto admm = SolverMethod::admm;
  EXPECT_TRUE(calls(admm, view(0, 0, 0, false, true)));
  EXPECT_FALSE(calls(admm, view(199, 1, 0)));
  EXPECT_TRUE(calls(admm, view(200, 1, 0)));
  EXPECT_FALSE(calls(admm, view(200, 1, 0, false, true))) << "in balance";
  EXPECT_FALSE(calls(admm, view(799, 2, 0)));
  EXPECT_TRUE(calls(admm, view(800, 2, 0)));
  EXPECT_FALSE(calls(admm, view(100000, 3, 0))) << "the last call is spent";
}

TEST(Methods, AutomaticCallsAdmmWhereSweepsHadTheirChanceInAStiffProblem) {
  const auto automatic = SolverMethod::automatic;
  EXPECT_FALSE(calls(automatic, view(49, 0, 1000)));
  EXPECT_TRUE(calls(automatic, view(50, 0, 1000)));
  EXPECT_FALSE(calls(automatic, view(50, 0, 999)));
  EXPECT_FALSE(calls(automatic, view(50, 0, 1000, false, true))) << "in balance";
  EXPECT_FALSE(calls(automatic, view(1000, 0, 10)));
  EXPECT_TRUE(calls(automatic, view(1000, 0, 10, true))) << "sweeps took as long as stiff problems do";
  EXPECT_FALSE(calls(automatic, view(999, 0, 10, true)));
}

TEST(Methods, MomentumBeginsPlainAndGrowsToItsMost) {
  const MomentumParameters parameters;
  EXPECT_EQ(momentum_beta(parameters, 3, 0.9), 0);
  EXPECT_EQ(momentum_beta(parameters, 4, 0.9), 0.25);
  EXPECT_EQ(momentum_beta(parameters, 1000, 0.9), 0.9);
}

TEST(Methods, ConjugateGradientsBeginAnewWhenASweepChangesMore) {
  ConjugateGradient gradient;
  gradient.turn(4);
  EXPECT_EQ(gradient.beta, 0);
  gradient.turn(1);
  EXPECT_EQ(gradient.beta, 0.25);
  gradient.turn(2);
  EXPECT_EQ(gradient.beta, 0);
}

}  // namespace
}  // namespace talus
