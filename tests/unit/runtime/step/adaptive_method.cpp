/// Momentum that follows the error ("nlgs+adaptive").

#include <gtest/gtest.h>

#include "runtime/step/methods/method.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/runtime/step/loose_scenes.hpp"

namespace talus::simulation_test {
namespace {

constexpr SolverMethod adaptive("nlgs+adaptive");

std::unique_ptr<Method> made_adaptive(bool plain) {
  static const SolverSettings settings;
  return methods().of(adaptive).make({settings, true, plain});
}

TEST(AdaptiveMethod, TakesMoreMomentumWhileTheErrorFallsSlowlyAndLessWhereItGrows) {
  const auto method = made_adaptive(false);
  SweepPlan plan = method->begin();
  EXPECT_EQ(plan.kind, SweepKind::momentum);
  EXPECT_FALSE(method->after_check(plan, 0.1)) << "fast enough";
  for (int check = 0; check < 10; ++check)
    if (const auto next = method->after_check(plan, 0.9)) {
      EXPECT_NEAR(1 - next->most, (1 - plan.most) / 2, 1e-15);
      plan = *next;
    }
  EXPECT_EQ(plan.most, 0.98) << "and no more";
  const auto less = method->after_check(plan, 1.1);
  ASSERT_TRUE(less);
  EXPECT_NEAR(less->most, 0.96, 1e-15);
  const auto hopeless = method->after_check(plan, 4);
  ASSERT_TRUE(hopeless);
  EXPECT_EQ(hopeless->kind, SweepKind::plain);
}

TEST(AdaptiveMethod, SweepsPlainlyWhereSweepsCannotBeAccelerated) {
  EXPECT_EQ(made_adaptive(true)->begin().kind, SweepKind::plain);
  EXPECT_FALSE(made_adaptive(true)->after_check({}, 0.9));
}

/// Sweeps of a few steps in which a box squeezes grains, and the digest of what they have become.
struct Squeezed {
  std::int64_t sweeps = 0;
  std::uint64_t digest = 0;
  bool converged = true;
};
Squeezed squeezed(SolverMethod method, int threads) {
  talus::Setup setup;
  setup.walls = box(6 * 2.1 * radius, 6 * 2.1 * radius, 6 * 2.1 * radius);
  Stage squeeze = stage("squeeze", 25);
  for (const char* name : {"x+", "y+", "z+"}) squeeze.loads.push_back({name, pressed(2e4)});
  setup.stages = {squeeze};
  setup.solver.method = method;
  setup.solver.tolerance = 1e-5;
  setup.solver.max_iterations = 20000;
  setup.solver.overlap_tolerance = 100;  // walls run into loose grains, and far into some
  graph::Executor executor({.threads = threads});
  Simulation simulation(setup, loose_sample(6, 6, 6, 5), executor);
  Squeezed outcome;
  while (!simulation.finished()) {
    const StepReport& report = simulation.step();
    outcome.sweeps += report.iterations;
    outcome.converged = outcome.converged && report.converged;
    simulation.begin_next_stage();
  }
  outcome.digest = simulation.digest();
  return outcome;
}

TEST(AdaptiveMethod, ReachesTheErrorInHalfThePlainSweepsWithTheSameBitsOnAnyThreads) {
  const Squeezed plain = squeezed(SolverMethod::nlgs, 1), own = squeezed(adaptive, 1);
  EXPECT_TRUE(plain.converged);
  EXPECT_TRUE(own.converged);
  EXPECT_LT(own.sweeps, plain.sweeps / 2);
  EXPECT_EQ(squeezed(adaptive, 2).digest, own.digest);
}

}  // namespace
}  // namespace talus::simulation_test
