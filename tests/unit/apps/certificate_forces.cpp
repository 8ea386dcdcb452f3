// The forces next to a run's that the judge of `talus study certificate` compares it with.

#include <gtest/gtest.h>

#include <array>

#include "apps/study_certificate/friction_newton.hpp"
#include "tests/unit/apps/audited_step.hpp"

namespace talus::audit {
namespace {

TEST(CertificateForces, AsksRedundantContactsForTheirShareOnlyWhereGapsTellIt) {
  // Two floors, the second lower by a part of g h^2: the first carries all. A run that has shared the weight
  // is wrong, unless it takes a change of the gaps to find out that no step before has kept to.
  for (const double friction : {0.0, 0.3})
    for (const double lower : {1e-8, 1e-6, 1e-3}) {
      Step step(g, friction);
      step.grain({0, 0, R}, R);
      step.wall(Vec3::Zero(), Vec3::UnitZ());
      step.wall({0, 0, -lower * g * h * h}, Vec3::UnitZ());
      const StepProblem problem = step.problem();
      ASSERT_EQ(problem.contacts.size(), 2U);
      const Vec3 weight(0, 0, mass_of(R) * g * h);
      const std::vector<Vec3> shared(2, weight / 2);
      const Reference answer = solve_reference(problem, shared);
      ASSERT_EQ(answer.found, Found::answer) << friction << ' ' << lower;
      const Vec3 first = lower < 1e-5 ? Vec3(weight / 2) : weight;
      EXPECT_NEAR((answer.r[0] - first).norm() / weight.norm(), 0, 1e-3) << friction << ' ' << lower;
      EXPECT_NEAR((answer.r[0] + answer.r[1] - weight).norm() / weight.norm(), 0, 1e-3);
      EXPECT_LT(answer.motion.u[0].norm(), 1e-6 * g * h);
    }
}

/// Four grains between a floor and a lid that is 10^5 times as heavy, which is pressed down.
Step four_columns(double pressed) {
  Step step(0, 0.3);
  for (const double x : {0.0, 3 * R})
    for (const double y : {0.0, 3 * R}) step.grain({x, y, R}, R);
  step.wall(Vec3::Zero(), Vec3::UnitZ());
  Wall& lid = step.wall({0, 0, 2 * R}, -Vec3::UnitZ());
  lid.load = {.drive = WallDrive::force, .force = pressed, .mass = 1e5 * mass_of(R)};
  return step;
}

TEST(CertificateForces, OfColumnsUnderAHeavyLidAreTheRunsAndEachGivesAsMuchOfWhatIsMissing) {
  // The columns may share the load in any way: what the run lacks of it comes from all alike, and a column
  // that had less than its part of what is too much ends without a force.
  constexpr double load = 1000;
  const StepProblem problem = four_columns(load).problem();
  ASSERT_EQ(problem.contacts.size(), 8U);
  const auto shared_out = [&](std::span<const double> shares) {
    std::vector<Vec3> run;
    for (const StepContact& contact : problem.contacts)
      run.push_back(shares[contact.first] * load * h * contact.normal);
    return run;
  };
  struct Case {
    std::vector<double> run, nearest;
  };
  for (const Case& one : {Case{{0.4, 0.3, 0.2, 0.096}, {0.401, 0.301, 0.201, 0.097}},
                          Case{{0.25, 0.25, 0.25, 0.254}, {0.249, 0.249, 0.249, 0.253}},
                          Case{{0.001, 0.3, 0.4, 0.307}, {0, 0.29766667, 0.39766667, 0.30466667}}}) {
    const std::vector<Vec3> exact = shared_out(std::vector<double>(4, 0.25)), run = shared_out(one.run),
                            nearest = shared_out(one.nearest);
    const FrictionNewton newton(problem, 1e-4);
    std::vector<Vec3> r;
    ASSERT_TRUE(newton.keep_velocities(run, exact, {1e-5, newton.unit(run), 1e-9 * load * h}, r));
    for (std::size_t c = 0; c < nearest.size(); ++c)
      EXPECT_LT((r[c] - nearest[c]).norm(), 1e-6 * load * h) << c << ' ' << one.run[0];
  }
}

/// Per contact: the relative velocity that its own unit impulse makes, along the normal and across it [1/kg].
/// A moment of rolling resistance has no normal part.
std::vector<std::array<double, 2>> mobilities(const StepProblem& problem) {
  std::vector<std::array<double, 2>> all;
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const StepContact& contact = problem.contacts[c];
    const auto answers = [&](const Vec3& way) {
      std::vector<Vec3> r(problem.contacts.size(), Vec3::Zero());
      r[c] = way;
      const Vec3 v = relative_velocity(contact, motion_under(problem, r));
      return (v - relative_velocity(contact, problem.free)).dot(way);
    };
    all.push_back(
        {contact.is_moment() ? 0 : answers(contact.normal), answers(contact.normal.unitOrthogonal())});
  }
  return all;
}

/// Of impulses, in the norm in which they are near one another.
double product(const StepProblem& problem, std::span<const Vec3> a, std::span<const Vec3> b) {
  double sum = 0;
  const std::vector<std::array<double, 2>> mobility = mobilities(problem);
  for (std::size_t c = 0; c < a.size(); ++c) {
    const Vec3& n = problem.contacts[c].normal;
    const double normal = a[c].dot(n) * b[c].dot(n);
    sum += mobility[c][0] * normal + mobility[c][1] * (a[c].dot(b[c]) - normal);
  }
  return sum;
}

TEST(CertificateForces, ThatKeepTheVelocitiesAreTheNearestOfAll) {
  // What is nearest in a convex set sees no other member of it at less than a right angle from the run's.
  const double impulse = mass_of(R) * g * h;
  int moved = 0;
  for (std::uint64_t seed = 1; seed <= 9; ++seed) {
    Step step = small_pile(seed == 6 ? 0 : 0.3, seed);
    if (seed > 6) step.stage.laws.set_all(&PairLaw::rolling_resistance, 0.2);
    const StepProblem problem = step.problem();
    const Reference answer = solved(problem);
    const FrictionNewton newton(problem, 1e-4);
    const FrictionNewton::Room room{1e-6, newton.unit(answer.exact), 1e-9 * answer.exchanged};
    std::vector<std::vector<Vec3>> runs, near;
    Draws draws(seed, 3);
    for (int k = 0; k < 6; ++k) {
      runs.push_back(answer.exact);
      for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
        const StepContact& contact = problem.contacts[c];
        Vec3 more = impulse * draws.direction();
        if (contact.is_moment()) more -= more.dot(contact.normal) * contact.normal;
        runs.back()[c] += more;
      }
      ASSERT_TRUE(newton.keep_velocities(runs.back(), answer.exact, room, near.emplace_back()));
      EXPECT_LT(newton.apart(near.back(), answer.exact), 1e-8 * answer.exchanged);
    }
    near.push_back(answer.exact);
    const auto minus = [](std::vector<Vec3> a, const std::vector<Vec3>& b) {
      for (std::size_t c = 0; c < a.size(); ++c) a[c] -= b[c];
      return a;
    };
    for (std::size_t k = 0; k < runs.size(); ++k) {
      const std::vector<Vec3> away = minus(runs[k], near[k]);
      for (const std::vector<Vec3>& other : near) {
        const std::vector<Vec3> along = minus(other, near[k]);
        EXPECT_LE(product(problem, away, along), 1e-5 * product(problem, away, away)) << seed << ' ' << k;
        moved += product(problem, along, along) > 1e-4 * product(problem, away, away) ? 1 : 0;
      }
    }
  }
  EXPECT_GT(moved, 0);  // some pile has more contacts than its motion tells
}

}  // namespace
}  // namespace talus::audit
