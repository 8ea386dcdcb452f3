// The judge of `talus study certificate`: its problems and answers against closed forms and brute force.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/sample_builder.hpp"
#include "apps/study_certificate/calibration.hpp"
#include "apps/study_certificate/certificate_report.hpp"
#include "apps/study_certificate/scene_maker.hpp"
#include "apps/study_certificate/study_certificate.hpp"
#include "kernels/samples/sample.hpp"
#include "tests/unit/apps/audited_step.hpp"
#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::audit {
namespace {

Step wedge(double half_angle) {
  Step step(g, 0);
  const double c = std::cos(half_angle), s = std::sin(half_angle);
  step.grain({0, 0, R / s}, R);
  step.wall(Vec3::Zero(), {c, 0, s});
  step.wall(Vec3::Zero(), {-c, 0, s});
  return step;
}

TEST(CertificateReference, AWallOfAWedgeCarriesTheWeightOverTwiceTheSine) {
  for (const double a : {1e-3, 1e-2, 0.5}) {
    const StepProblem problem = wedge(a).problem();
    const Reference answer = solved(problem);
    ASSERT_EQ(answer.found, Found::answer) << a;
    const double exact = mass_of(R) * g * h / (2 * std::sin(a));
    for (const Vec3& r : answer.r) EXPECT_NEAR(r.norm(), exact, 1e-5 * exact) << a;
    EXPECT_LT(answer.motion.u[0].norm(), 1e-7 * g * h) << a;
  }
}

TEST(CertificateReference, AColumnStandsOnItsWeight) {
  for (const double friction : {0.0, 0.35}) {
    Step step(g, friction);
    constexpr int grains = 60;
    for (int k = 0; k < grains; ++k) step.grain({0, 0, (2 * k + 1) * R}, R);
    step.wall(Vec3::Zero(), Vec3::UnitZ());
    const StepProblem problem = step.problem();
    const Reference answer = solved(problem);
    ASSERT_EQ(answer.found, Found::answer);
    for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
      const auto above = grains - static_cast<double>(problem.contacts[c].first);
      EXPECT_NEAR(answer.r[c][2], above * mass_of(R) * g * h, 1e-6 * grains * mass_of(R) * g * h);
    }
  }
}

TEST(CertificateReference, TwoBodiesInImpactKeepMomentumAndReverseTheirApproach) {
  constexpr double e = 0.6, v = 2;
  Step step(0, 0.3, e);
  step.grain({0, 0, 0}, R, {v, 0, 0});
  step.grain({2 * R, 0, 0}, 2 * R);
  step.before.x[1][0] = 3 * R - 1e-2 * R;  // they overlap a little: the impact law holds
  const StepProblem problem = step.problem();
  const Reference answer = solved(problem);
  ASSERT_EQ(answer.found, Found::answer);
  EXPECT_EQ(problem.reflection, e);
  const double m1 = mass_of(R), m2 = mass_of(2 * R);
  // The problem is one of mean velocities of the impact.
  const auto behind = [&](std::size_t k) {
    return (1 + e) * answer.motion.u[k][0] - e * step.before.u[k][0];
  };
  EXPECT_NEAR(behind(0), (m1 - e * m2) / (m1 + m2) * v, 1e-9 * v);
  EXPECT_NEAR(behind(1), (1 + e) * m1 / (m1 + m2) * v, 1e-9 * v);
}

TEST(CertificateReference, AGrainThrownOnAFloorSlidesBackByFrictionOrSticks) {
  // Spin of a solid sphere: r_t <= mu r_n slides, else the contact point stops, u = 5/7 of what it was.
  for (const double along : {1e-4, 1.0}) {
    constexpr double mu = 0.3, down = 0.5;
    Step step(0, mu);
    step.grain({0, 0, R}, R, {along, 0, -down});
    step.before.x[0][2] += h / 2 * down;  // touches in the middle of the step
    step.wall(Vec3::Zero(), Vec3::UnitZ());
    const Reference answer = solved(step.problem());
    ASSERT_EQ(answer.found, Found::answer);
    const bool slides = along > 3.5 * mu * down;
    EXPECT_NEAR(answer.motion.u[0][0], slides ? along - mu * down : 5.0 / 7 * along, 1e-9 * along);
    EXPECT_NEAR(answer.motion.u[0][2], 0, 1e-9);
  }
}

TEST(CertificateReference, ALightLidMeetsAGrainByItsSpeedAtTheEndOfTheStep) {
  // The load takes the lid to 1.1 m/s in the step, 0.9 of which would close the gap; the mean velocity of the
  // impact, which the problem is about, is 0.73 m/s only. The pair turns in this step.
  constexpr double e = 0.6, gap = 0.9e-3;
  Step step(0, 0, e);
  step.grain({0, 0, R}, R, {0, 0, 0.1});
  Wall& lid = step.wall({0, 0, 2 * R + gap + 0.1 * h / 2}, -Vec3::UnitZ());
  lid.load = {.drive = WallDrive::force, .force = 1e-3 / h, .mass = 1e-3};
  const StepProblem problem = step.problem();
  ASSERT_EQ(problem.contacts.size(), 1U);
  EXPECT_NEAR(problem.contacts[0].bias, 0, 1e-12);
}

TEST(CertificateReference, AGrainMeetsAFloorThatOnlyGravityBringsItTo) {
  // At rest beyond the alert distance: without the fall of this step the pair would not be looked at.
  constexpr double gap = 0.5 * g * h * h;
  Step step(g, 0);
  step.setup.detection.alert = 0.1 * gap;
  step.grain({0, 0, R + gap}, R);
  step.wall(Vec3::Zero(), Vec3::UnitZ());
  const StepProblem problem = step.problem();
  ASSERT_EQ(problem.contacts.size(), 1U);
  EXPECT_NEAR(solved(problem).motion.u[0][2], -gap / h, 1e-9 * g * h);
}

TEST(CertificateReference, WhereTheRunCarriesAGapOfRoundingIsNone) {
  for (const double gap : {7e-18, 1e-9}) {
    Step step(0, 0, 1);
    constexpr double apart = 1e-9;  // [m/s]; their gap is that of the middle of the step
    step.grain({-R, 0, 0}, R, {-apart, 0, 0});
    step.grain({R + gap - h / 2 * apart, 0, 0}, R);
    Frame after = step.before;
    after.contact_bodies.push_back({0, 1});
    ASSERT_TRUE(step.problem().contacts.empty()) << gap;
    const StepInput input{step.before, {}, {}, step.stage, step.bodies, step.setup, 0, 0, {}, &after};
    EXPECT_EQ(rebuild_step(input).contacts.size(), gap < 1e-12 ? 1U : 0U) << gap;
  }
}

TEST(CertificateReference, OfAGrainThatMayBeJammedOrFallTellsWhatTheRunHasFound) {
  // Between two parallel walls friction holds it once they press, and nothing makes them press: jammed, or in
  // free fall, both are answers.
  constexpr double friction = 0.5;
  Step step(g, friction);
  step.grain(Vec3::Zero(), R);
  step.wall({-R, 0, 0}, Vec3::UnitX());
  step.wall({R, 0, 0}, -Vec3::UnitX());
  const StepProblem problem = step.problem();
  ASSERT_EQ(problem.contacts.size(), 2U);
  const double weight = mass_of(R) * g * h;
  for (const double pressed : {0.0, 3.0}) {
    std::vector<Vec3> run;
    for (const StepContact& contact : problem.contacts)
      run.push_back(pressed * weight * contact.normal + (pressed > 0 ? 0.5 : 0) * weight * Vec3::UnitZ());
    const Reference answer = solve_reference(problem, run);
    ASSERT_EQ(answer.found, Found::answer) << pressed;
    for (std::size_t c = 0; c < run.size(); ++c) EXPECT_LT((answer.r[c] - run[c]).norm(), 1e-6 * weight);
    EXPECT_NEAR(answer.motion.u[0][2], pressed > 0 ? 0 : -g * h, 1e-6 * g * h) << pressed;
  }
}

/// Velocities of the smooth problem by trying every set of contacts that carry.
std::vector<Vec3> by_brute_force(const StepProblem& problem) {
  const std::size_t contacts = problem.contacts.size();
  Eigen::MatrixXd W(contacts, contacts);
  Eigen::VectorXd q(contacts);
  const auto index = [](std::size_t k) { return static_cast<Eigen::Index>(k); };
  for (std::size_t d = 0; d < contacts; ++d) {
    std::vector<Vec3> unit(contacts, Vec3::Zero());
    unit[d] = problem.contacts[d].normal;
    const Motion moved = motion_under(problem, unit);
    for (std::size_t c = 0; c < contacts; ++c) {
      const StepContact& contact = problem.contacts[c];
      const double free = relative_velocity(contact, problem.free).dot(contact.normal);
      W(index(c), index(d)) = relative_velocity(contact, moved).dot(contact.normal) - free;
      q[index(c)] = free + contact.bias;
    }
  }
  for (std::size_t set = 0; set < std::size_t{1} << contacts; ++set) {
    std::vector<Eigen::Index> carry;
    for (std::size_t c = 0; c < contacts; ++c)
      if (set >> c & 1U) carry.push_back(index(c));
    Eigen::VectorXd r = Eigen::VectorXd::Zero(index(contacts));
    if (!carry.empty()) {
      const Eigen::MatrixXd block = W(carry, carry);
      const Eigen::FullPivLU<Eigen::MatrixXd> factor(block);
      if (!factor.isInvertible()) continue;
      r(carry) = factor.solve(-q(carry));
    }
    const Eigen::VectorXd y = W * r + q;
    if (r.minCoeff() < -1e-12 * r.cwiseAbs().maxCoeff() || y.minCoeff() < -1e-9 * q.cwiseAbs().maxCoeff())
      continue;
    std::vector<Vec3> impulses;
    for (std::size_t c = 0; c < contacts; ++c) impulses.push_back(r[index(c)] * problem.contacts[c].normal);
    return motion_under(problem, impulses).u;
  }
  return {};
}

TEST(CertificateReference, AgreesWithBruteForceOnSmallSmoothPiles) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const StepProblem problem = small_pile(0, seed).problem();
    ASSERT_LE(problem.contacts.size(), 20U);
    const Reference answer = solved(problem);
    ASSERT_EQ(answer.found, Found::answer);
    const std::vector<Vec3> exact = by_brute_force(problem);
    ASSERT_EQ(exact.size(), answer.motion.u.size());
    for (std::size_t k = 0; k < exact.size(); ++k)
      EXPECT_LT((answer.motion.u[k] - exact[k]).norm(), 1e-9 * g * h) << seed;
  }
}

TEST(CertificateReference, WithFrictionMeetsTheLawOfCoulomb) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const StepProblem problem = small_pile(0.3, seed).problem();
    const Reference answer = solved(problem);
    ASSERT_EQ(answer.found, Found::answer);
    const double impulse = mass_of(R) * g * h, speed = g * h;
    for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
      const StepContact& contact = problem.contacts[c];
      const Vec3 v = relative_velocity(contact, answer.motion);
      const double v_n = v.dot(contact.normal) + contact.bias, r_n = answer.r[c].dot(contact.normal);
      const Vec3 v_t = v - v.dot(contact.normal) * contact.normal, r_t = answer.r[c] - r_n * contact.normal;
      EXPECT_GE(r_n, -1e-9 * impulse);
      EXPECT_GE(v_n, -1e-8 * speed);
      EXPECT_LT(std::min(r_n / impulse, v_n / speed), 1e-8);
      EXPECT_LE(r_t.norm(), contact.friction * r_n + 1e-8 * impulse);
      if (v_t.norm() > 1e-6 * speed && r_n > 1e-6 * impulse) {
        EXPECT_LT((r_t + contact.friction * r_n * v_t.normalized()).norm(), 1e-5 * impulse);
      }
    }
  }
}

TEST(CertificateReference, KnowsThatACrushedGrainHasNoAnswer) {
  for (const double friction : {0.0, 0.3}) {
    Step step(g, friction);
    step.grain({0, 0, R}, R);
    step.wall(Vec3::Zero(), Vec3::UnitZ());
    Wall& lid = step.wall({0, 0, 2 * R}, -Vec3::UnitZ());
    lid.load = {.drive = WallDrive::velocity, .velocity = Vec3(0, 0, -0.1)};
    lid.velocity = lid.load.velocity;
    const Reference answer = solved(step.problem());
    EXPECT_EQ(answer.found, Found::no_answer) << friction;
    EXPECT_GT(answer.residual, 0.1) << friction;
  }
}

TEST(CertificateReference, SolvesClustersThatDoNotTouchEachByItself) {
  Step step = wedge(0.1);
  step.grain({10, 0, 1000}, R, {1, 0, 0});
  step.grain({10 + 2 * R, 0, 1000}, R, {-1, 0, 0});
  const StepProblem problem = step.problem();
  std::size_t count = 0;
  clusters_of(problem, count);
  EXPECT_EQ(count, 2U);
  const Reference answer = solved(problem);
  EXPECT_LT(answer.motion.u[0].norm(), 1e-7 * g * h);
  EXPECT_LT(std::abs(answer.motion.u[1][0]), 1e-9);
}

/// A step that ends as its impulses say.
Frame ended(const StepProblem& problem, const Step& step, const std::vector<Vec3>& r) {
  Frame after = step.before;
  after.u = motion_under(problem, r).u;
  for (std::size_t w = 0; w < step.setup.walls.size(); ++w) {
    WallReport wall;
    for (std::size_t c = 0; c < r.size(); ++c)
      if (problem.contacts[c].at_wall() && problem.contacts[c].wall() == w) wall.force += r[c] / h;
    after.walls.push_back(wall);
  }
  return after;
}

TEST(CertificateErrors, OfAnAnswerAreNoneAndOfHalfTheForcesAHalf) {
  const Step step = wedge(0.1);
  const StepProblem problem = step.problem();
  const Reference answer = solved(problem);
  std::vector<Vec3> half = answer.r;
  const TrueErrors none = true_errors(problem, answer, {ended(problem, step, half), half});
  EXPECT_LT(std::max({none.velocity, none.wall_force, none.contact_force, none.cluster}), 1e-12);
  for (Vec3& r : half) r /= 2;
  const TrueErrors some = true_errors(problem, answer, {ended(problem, step, half), half});
  EXPECT_NEAR(some.velocity, 0.5, 1e-9);
  EXPECT_NEAR(some.wall_force, 0.5, 1e-9);
  EXPECT_NEAR(some.contact_force, 0.5, 1e-9);
  EXPECT_NEAR(some.cluster, 0.5, 1e-9);
}

// A grain that gains a hundred roundings of positions is known to a twentieth: a claim of a thousandth says
// nothing of it until it is off by many.
TEST(CertificateErrors, OfWhatIsKnownWorseThanTheClaimAreLeftOut) {
  const Step step = wedge(0.1);
  StepProblem problem = step.problem();
  const Reference answer = solved(problem);
  problem.rounding_speed = g * h / 100;
  constexpr double claimed = 1e-3;
  const auto worst = [&](double roundings, double claim) {
    std::vector<Vec3> r = answer.r;
    for (Vec3& impulse : r) impulse *= 1 - roundings / 100;
    const Frame after = ended(problem, step, r);
    StepEnd end{after, r};
    end.claimed = claim;
    const TrueErrors errors = true_errors(problem, answer, end);
    return std::array{std::min(errors.velocity, errors.cluster), std::max(errors.velocity, errors.cluster)};
  };
  EXPECT_GT(worst(8, 0.1)[0], 0.02) << "beyond the five that are excused";
  EXPECT_LT(worst(8, claimed)[1], claimed);
  EXPECT_GT(worst(50, claimed)[0], 5 * claimed);
}

TEST(CertificateErrors, OfAContactInARowAreNotWhatRoundingMakesOfItsGrains) {
  Step step(0, 0);
  constexpr int grains = 10;
  for (int k = 0; k < grains; ++k) step.grain({2 * R * k, 0, 0}, R, {0, 0.1, 0});
  StepProblem problem = step.problem();
  problem.rounding_speed = 1e-12;
  Reference answer = solved(problem);
  // Of the size of rounding: the middle contact passes on what is between both halves.
  std::vector<Vec3> r = answer.r;
  for (std::size_t c = 0; c < r.size(); ++c) {
    answer.r[c] = 100 * mass_of(R) * problem.rounding_speed * problem.contacts[c].normal;
    r[c] = 0.7 * answer.r[c];
  }
  const StepEnd end{ended(problem, step, answer.exact), r};
  EXPECT_EQ(true_errors(problem, answer, end).contact_force, 0);
  r.assign(r.size(), Vec3::Zero());
  EXPECT_GT(true_errors(problem, answer, {ended(problem, step, answer.exact), r}).contact_force, 0.1);
}

TEST(CertificateErrors, EnergyGrowsByMotionAndNotByWhatTheCorrectionOfOverlapsLifts) {
  for (const double restitution : {0.0, 0.9}) {
    Step step(g, 0, restitution);
    step.grain(Vec3::Zero(), R, {0, 0, 1});
    Frame after = step.before;
    after.u[0][2] = 1 - g * h;
    after.x[0][2] = h + 1e-3 * R;
    EXPECT_LT(energy_gain(step.problem(), step.before, after), 1e-15);
    after.u[0][2] = 1;
    EXPECT_NEAR(energy_gain(step.problem(), step.before, after), 2 * g * h, 0.1 * g * h);
  }
}

TEST(CertificateErrors, OfOneClusterDoNotHideAmongOthers) {
  Step step = wedge(0.1);
  for (int k = 0; k < 50; ++k) step.grain({0, 1.0 + 3 * R * k, R / std::sin(0.1)}, R);
  const StepProblem problem = step.problem();
  const Reference answer = solved(problem);
  std::vector<Vec3> r = answer.r;
  for (std::size_t c = 0; c < r.size(); ++c)
    if (problem.contacts[c].first == 0) r[c].setZero();
  const TrueErrors errors = true_errors(problem, answer, {ended(problem, step, r), r});
  EXPECT_NEAR(errors.velocity, 1.0 / 51, 1e-6);
  EXPECT_NEAR(errors.cluster, 1, 1e-6);
}

}  // namespace
}  // namespace talus::audit
