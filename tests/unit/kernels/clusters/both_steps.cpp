// What both kinds of proximal steps have to find: the closed forms of one grain.

#include <gtest/gtest.h>

#include "kernels/clusters/coulomb_newton.hpp"
#include "kernels/clusters/proximal_newton.hpp"
#include "tests/unit/kernels/clusters/cluster_makers.hpp"

namespace talus::both_steps_test {
namespace {

using namespace cluster_makers;

struct Steps {
  const char* name;
  Correction (*corrected)(const BodyProblem& problem);
};
const Steps both[] = {
    {"Coulomb's law",
     [](const BodyProblem& problem) {
       double work = 1e9;
       return coulomb_correction(problem, {.enough = enough, .relative = 1e-3}, {}, {}, work).best;
     }},
    {"convex", [](const BodyProblem& problem) {
       double work = 1e9;
       return proximal_correction(problem, {.enough = enough, .relative = 1e-3}, {}, {}, work).best;
     }}};

TEST(BothSteps, AGrainSlidesOrSticksAsCoulombSays) {
  constexpr double mu = 0.3, down = 0.1;
  for (const auto& [name, corrected] : both)
    for (const double along : {1e-2, 1.0}) {
      BodyProblem problem;
      const std::int32_t grain = add_grain(problem, Vec3::Zero(), mu);
      problem.bodies[0].free.u = Vec3(along, 0, -down);
      add_contact(problem, grain, -1, Vec3::UnitZ(), mu, 0);
      const Correction answer = corrected(problem);
      ASSERT_TRUE(answer.settled) << name << along;
      const bool slides = along > 3.5 * mu * down;  // a solid sphere keeps 5/7 of its speed where it sticks
      EXPECT_NEAR(impulse_of(problem, answer, 0).z(), down, 1e-4) << name;
      EXPECT_NEAR(impulse_of(problem, answer, 0).x(), slides ? -mu * down : -2.0 / 7 * along, 1e-4) << name;
      EXPECT_NEAR(answer.motion[0].u.z(), down, enough) << name << ": it no longer sinks";
    }
}

TEST(BothSteps, LetGoOfContactsThatWouldPull) {
  for (const auto& [name, corrected] : both)
    for (const double mu : {0.0, 0.3}) {
      BodyProblem problem;
      const std::int32_t grain = add_grain(problem, Vec3::Zero(), mu);
      add_contact(problem, grain, -1, Vec3::UnitZ(), mu, 0);
      problem.bodies[0].free.u = Vec3(0, 0, fall);  // it leaves
      problem.impulse[0] = 0.5 * fall * Vec3::UnitZ();
      const Correction answer = corrected(problem);
      EXPECT_TRUE(answer.settled) << name << mu;
      EXPECT_NEAR(impulse_of(problem, answer, 0).norm(), 0, enough) << name << mu;
    }
}

}  // namespace
}  // namespace talus::both_steps_test
