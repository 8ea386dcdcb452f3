/// The law of spheres on one lane, against the plain reference, several lanes, and the other forms of it.

#include "kernels/law/contact_law.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "kernels/law/friction_cone.hpp"
#include "kernels/law/gap_law.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::Random;
using test::uniform;
using test::uniform_vector;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

Space<double> space_of(const Vec3& a) {
  return {a[0], a[1], a[2]};
}
Vec3 vector_of(const Space<double>& a) {
  return {a.x, a.y, a.z};
}

/// A contact in the frame (n, t, s) of friction_cone.hpp.
struct Frame {
  Eigen::Matrix3d axes;  ///< rows n, t, s

  explicit Frame(Random& random) {
    axes.row(0) = uniform_vector(random, -1, 1).normalized();
    axes.row(1) = axes.row(0).cross(uniform_vector(random, -1, 1)).normalized();
    axes.row(2) = axes.row(0).cross(axes.row(1));
  }
  Space<double> normal() const { return {axes(0, 0), axes(0, 1), axes(0, 2)}; }
};

TEST(ContactLaw, ProjectsOnTheConeThatBlocksProjectOn) {
  Random random(1);
  for (int k = 0; k < 2000; ++k) {
    const Frame frame(random);
    const Vec3 z = uniform_vector(random, -1, 1);
    for (const double mu : {0.0, 0.1, 0.5, 2.0}) {
      const Vec3 here = vector_of(project_on_cone(space_of(frame.axes.transpose() * z), frame.normal(), mu));
      EXPECT_LT((frame.axes * here - talus::project_on_cone(z, mu)).norm(), 50 * epsilon)
          << k << ", mu " << mu;
    }
  }
}

TEST(ContactLaw, MeasuresTheNaturalMapThatBlocksAreJudgedBy) {
  Random random(2);
  for (int k = 0; k < 2000; ++k) {
    const Frame frame(random);
    const Vec3 r = uniform_vector(random, -1, 1), v = uniform_vector(random, -1, 1);
    const double mu = uniform(random, 0, 1), bias = uniform(random, -0.3, 0.3), w_nn = 2;
    const LawError<double> error =
        error_of_law<double>(space_of(frame.axes.transpose() * r),
                             {frame.normal(), space_of(frame.axes.transpose() * v), bias, w_nn, 0}, mu);
    const Vec3 expected = w_nn * natural_map(r, v + bias * Vec3::UnitX(), mu, 1 / w_nn);
    EXPECT_NEAR(error.residual2, expected.squaredNorm(), 500 * epsilon);
  }
}

// One pass from any impulse and velocity: with W = W_nn 1 the law is the exact solve of the block.
TEST(ContactLaw, SolvesWhatTheBlockSolverSolvesWhereTangentsWeighLikeTheNormal) {
  Random random(3);
  int open = 0, stick = 0, slide = 0;
  for (int k = 0; k < 2000; ++k) {
    const Frame frame(random);
    const Vec3 v = uniform_vector(random, -1, 1);
    const double mu = uniform(random, 0.1, 1), bias = uniform(random, -0.3, 0.3), w = 2;
    const Vec3 r = frame.axes *
                   vector_of(solve_law<double>(
                       {0, 0, 0}, {frame.normal(), space_of(frame.axes.transpose() * v), bias, w, w}, mu, 1));
    const LocalSolution exact =
        solve_local(local_block(w * Mat3::Identity(), mu), v + bias * Vec3::UnitX(), Vec3::Zero());
    EXPECT_LT((r - exact.r).norm(), 100 * epsilon) << k;
    open += exact.status == LocalStatus::open;
    stick += exact.status == LocalStatus::stick;
    slide += exact.status == LocalStatus::slide;
  }
  EXPECT_GT(std::min({open, stick, slide}), 100) << open << " " << stick << " " << slide;
}

TEST(ContactLaw, GivesEveryLaneTheBitsOfADouble) {
  Random random(4);
  for (int k = 0; k < 2000; ++k) {
    double in[4][12];
    for (auto& lane : in)
      for (double& value : lane) value = uniform(random, -1, 1);
    const auto row = [&](std::size_t c) { return Quad{in[0][c], in[1][c], in[2][c], in[3][c]}; };
    const auto column = [&](std::size_t l, std::size_t c) {
      return Space<double>{in[l][c], in[l][c + 1], in[l][c + 2]};
    };
    const auto rows = [&](std::size_t c) { return Space<Quad>{row(c), row(c + 1), row(c + 2)}; };
    const Approach<Quad> contacts{rows(3), rows(6), row(9), absolute(row(10)), absolute(row(11))};
    const Space<Quad> lanes = solve_law<Quad>(rows(0), contacts, 0.4, Quad{} + 1.2),
                      own = solve_law<Quad>(rows(0), contacts, Quad{} + 0.4, Quad{} + 1.2);
    const LawError<Quad> errors = error_of_law<Quad>(rows(0), contacts, 0.4),
                         own_errors = error_of_law<Quad>(rows(0), contacts, Quad{} + 0.4);
    for (std::size_t l = 0; l < 4; ++l) {
      const Approach<double> contact{column(l, 3), column(l, 6), in[l][9], absolute(in[l][10]),
                                     absolute(in[l][11])};
      const Space<double> one = solve_law<double>(column(l, 0), contact, 0.4, 1.2);
      EXPECT_EQ(lanes.x[l], one.x);
      EXPECT_EQ(lanes.y[l], one.y);
      EXPECT_EQ(lanes.z[l], one.z);
      EXPECT_EQ(own.x[l], one.x) << "with a coefficient of its own";
      EXPECT_EQ(own_errors.residual2[l], errors.residual2[l]);
      const LawError<double> error = error_of_law<double>(column(l, 0), contact, 0.4);
      EXPECT_EQ(errors.residual2[l], error.residual2);
      EXPECT_EQ(errors.velocity2[l], error.velocity2);
    }
  }
}

TEST(GapLaw, LeavesOutPairsThatStayApartAndFollowsTheImpactLawOfFastOnes) {
  const GapRule rule{.time_step = 0.01, .alert = 0.1, .restitution = 0.5, .slow = 1};
  const auto solve = [&](double gap, double v_n) { return solve_gap(rule, gap, v_n, v_n, rule.restitution); };
  EXPECT_TRUE(solve(0.2, -10).absent) << "far, and too slow to close within the step";
  EXPECT_FALSE(solve(0.05, -0.5).absent);
  EXPECT_EQ(solve(0.05, -0.5).bias, 5) << "g/h";
  EXPECT_EQ(solve(-0.05, -0.5).bias, 0) << "an overlap stays";
  EXPECT_EQ(solve(-0.05, -2).bias, -1) << "e v_n";
  EXPECT_EQ(solve(0.05, -2).bias, 5) << "fast, and not there within the step";
  EXPECT_EQ(solve(0.05, -6).bias, -3) << "but this one is";
  EXPECT_EQ(solve(0.05, 6).bias, 5) << "nor one that separates";
  EXPECT_FALSE(solve(0.05, -2).absent);
  EXPECT_TRUE(solve_gap(rule, 0.05, -2.0, -2.0, 1.0).absent) << "with e = 1 it is not to lose energy";
  EXPECT_FALSE(solve_gap(rule, 0.05, -6.0, -6.0, 1.0).absent);
  EXPECT_TRUE(stays_apart(0.2, -10.0, 0.01, 0.1));
  EXPECT_FALSE(stays_apart(0.2, -30.0, 0.01, 0.1)) << "closes within the step";
}

// Otherwise a lattice that nothing has moved yet would lose energy as it is struck, and one that moves by
// rounding would not.
TEST(GapLaw, HasNoRestWithoutGravity) {
  GapRule rule{.time_step = 0.01, .alert = 0.1, .restitution = 1, .slow = 0};
  EXPECT_TRUE(solve_gap(rule, 0.05, 0.0, 0.0, 1.0).absent);
  EXPECT_EQ(solve_gap(rule, 0.05, 0.0, 0.0, 1.0).absent, solve_gap(rule, 0.05, 1e-12, 1e-12, 1.0).absent);
  EXPECT_FALSE(solve_gap(rule, 0.0, 0.0, 0.0, 1.0).absent) << "what touches is a contact";
  EXPECT_FALSE(solve_gap(rule, 0.05, 0.0, 0.0, 0.5).absent) << "with e < 1 others may push it together";
  rule.slow = 1;
  EXPECT_FALSE(solve_gap(rule, 0.05, 0.0, 0.0, 1.0).absent);
}

// v = (1 + E) vbar - E v-, where the contact carries and vbar = -b, is what each pair is to rebound with; and
// b >= 0, by which no contact creates energy.
TEST(GapLaw, GivesEachPairItsOwnReboundWithMoreausLaw) {
  const double reflection = 0.8;
  const auto rebound = [&](double e, double gap, double v_n) {
    const GapRule rule{
        .time_step = 0.01, .alert = 0.1, .restitution = e, .slow = 1, .reflection = reflection};
    const double b = solve_gap(rule, gap, v_n, v_n, e).bias;
    EXPECT_GE(b, 0);
    return -(1 + reflection) * b - reflection * v_n;
  };
  EXPECT_NEAR(rebound(0.8, -0.05, -2), 1.6, 1e-15);
  EXPECT_NEAR(rebound(0.5, -0.05, -2), 1, 1e-15);
  EXPECT_NEAR(rebound(0, -0.05, -2), 0, 1e-15);
  EXPECT_NEAR(rebound(0.5, -0.05, -0.5), 0, 1e-15) << "slow: at rest";
  EXPECT_NEAR(rebound(0.5, 0.02, -0.5), -2, 1e-14) << "slow: it may close its gap";
  EXPECT_NEAR(rebound(0.5, -0.05, 2), -1.6, 1e-15) << "what separates may be pushed back with E";
}

}  // namespace
}  // namespace talus
