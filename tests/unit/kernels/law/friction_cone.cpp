#include "kernels/law/friction_cone.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace talus::friction_cone_test {
namespace {

/// Random numbers that are the same on every platform (std distributions are not).
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_()) / 4294967296.0);
  }
  Vec3 vector() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }
  Mat3 matrix() {
    Mat3 m;
    for (int i = 0; i < 9; ++i) m(i) = uniform(-1, 1);
    return m;
  }

 private:
  std::mt19937 engine_;
};

/// The law, checked clause by clause and not by the natural map that the solver itself uses. Sizes are
/// relative to |r| and |q|.
void expect_law(const Mat3& W, const Vec3& q, double mu, const LocalSolution& s, double tolerance) {
  const Vec3 u = W * s.r + q;
  const double velocity = tolerance * std::max(q.norm(), (W.cwiseAbs() * s.r.cwiseAbs()).norm());
  const double impulse = tolerance * s.r.norm();
  const double rt = s.r.tail<2>().norm(), ut = u.tail<2>().norm();
  ASSERT_TRUE(s.r.allFinite());
  EXPECT_GE(s.r[0], 0);
  EXPECT_LE(rt, mu * s.r[0] + impulse);
  EXPECT_GE(u[0], -velocity);
  switch (s.status) {
    case LocalStatus::open:
      EXPECT_EQ(s.r.norm(), 0);
      break;
    case LocalStatus::stick:
      EXPECT_LE(u.norm(), velocity);
      break;
    case LocalStatus::slide: {
      EXPECT_LE(std::abs(u[0]), velocity);
      EXPECT_LE(std::abs(rt - mu * s.r[0]), impulse);
      EXPECT_LE((s.r.tail<2>() * ut + u.tail<2>() * rt).norm(), velocity * rt + impulse * ut);
      break;
    }
    case LocalStatus::failed:
      ADD_FAILURE() << "failed on W =\n" << W << "\nq = " << q.transpose() << "\nmu = " << mu;
  }
}

TEST(Cone, LeavesAPointInsideWhereItIs) {
  const Vec3 z(1, 0.2, -0.1);
  EXPECT_EQ(project_on_cone(z, 0.3), z);
}

TEST(Cone, SendsThePolarConeToItsApex) {
  EXPECT_EQ(project_on_cone(Vec3(-1, 1, 2), 0.3), Vec3::Zero());
}

TEST(Cone, ProjectsTheRestOnTheNearestGeneratrix) {
  const double mu = 0.5;
  const Vec3 z(0.1, 3, 4);
  const Vec3 p = project_on_cone(z, mu);
  EXPECT_NEAR(p.tail<2>().norm(), mu * p[0], 1e-15);
  EXPECT_NEAR((z - p).dot(p), 0, 1e-14);
  EXPECT_NEAR(p[1] / p[2], 0.75, 1e-15);
}

TEST(Cone, WithoutFrictionIsTheNormalHalfLine) {
  EXPECT_EQ(project_on_cone(Vec3(2, 3, 4), 0), Vec3(2, 0, 0));
  EXPECT_EQ(project_on_cone(Vec3(-2, 3, 4), 0), Vec3::Zero());
  EXPECT_EQ(project_on_cone(Vec3(-2, 0, 0), 0), Vec3::Zero());
  EXPECT_EQ(project_on_cone(Vec3(2, 0, 0), 0), Vec3(2, 0, 0));
}

TEST(Cone, ProjectionIsNearerThanAnyOtherPointOfTheCone) {
  Random random(1);
  for (const double mu : {0.0, 1e-3, 0.3, 1.0, 50.0, 1e200}) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 z = random.vector();
      const Vec3 p = project_on_cone(z, mu);
      EXPECT_LE(p.tail<2>().norm(), mu * p[0] * (1 + 1e-15));
      for (int k = 0; k < 50; ++k) {
        const double n = random.uniform(0, 2), t = std::min(mu * n, 2.0) * random.uniform(0, 1),
                     angle = random.uniform(0, 6.3);
        EXPECT_LE((z - p).norm(), (z - Vec3(n, t * std::cos(angle), t * std::sin(angle))).norm() + 1e-14);
      }
    }
  }
}

TEST(NaturalMap, VanishesExactlyOnTheLaw) {
  const double mu = 0.5;
  EXPECT_EQ(natural_map(Vec3::Zero(), Vec3(1, 5, 0), mu, 1).norm(), 0);             // open
  EXPECT_EQ(natural_map(Vec3(2, 0.3, 0.4), Vec3::Zero(), mu, 1).norm(), 0);         // stick
  EXPECT_NEAR(natural_map(Vec3(2, 1, 0), Vec3(0, -3, 0), mu, 1).norm(), 0, 1e-15);  // slide
  EXPECT_GT(natural_map(Vec3(2, 1, 0), Vec3(0, 3, 0), mu, 1).norm(), 0.1);  // slides along its friction
  EXPECT_GT(natural_map(Vec3(2, 1, 0), Vec3(1, -3, 0), mu, 1).norm(),
            0.1);  // dilates: the associated law's answer
  EXPECT_GT(natural_map(Vec3(1, 0, 0), Vec3(0.1, 0, 0), mu, 1).norm(),
            0.05);  // pulls apart under compression
}

TEST(LocalLaw, OpensWhenTheBodiesSeparate) {
  const auto s = solve_local(local_block(Mat3::Identity(), 0.5), Vec3(0.1, 5, 5), Vec3(1, 1, 1));
  EXPECT_EQ(s.status, LocalStatus::open);
  EXPECT_EQ(s.r, Vec3::Zero());
}

TEST(LocalLaw, SticksInsideTheCone) {
  const auto s = solve_local(local_block(2 * Mat3::Identity(), 0.5), Vec3(-2, 0.4, 0.2), Vec3::Zero());
  EXPECT_EQ(s.status, LocalStatus::stick);
  EXPECT_LT((s.r - Vec3(1, -0.2, -0.1)).norm(), 1e-15);
}

TEST(LocalLaw, SlidesAgainstTheVelocityOutsideTheCone) {
  const auto s = solve_local(local_block(2 * Mat3::Identity(), 0.5), Vec3(-2, 3, 4), Vec3::Zero());
  EXPECT_EQ(s.status, LocalStatus::slide);
  EXPECT_LT((s.r - Vec3(1, -0.3, -0.4)).norm(), 1e-15);
}

TEST(LocalLaw, WithoutFrictionIsSignorini) {
  Mat3 W = Mat3::Identity();
  W(1, 0) = W(0, 1) = 0.5;
  const auto s = solve_local(local_block(W, 0), Vec3(-3, 1, 0), Vec3::Zero());
  EXPECT_EQ(s.r, Vec3(3, 0, 0));
  expect_law(W, Vec3(-3, 1, 0), 0, s, 1e-15);
}

TEST(LocalLaw, HoldsForRandomPositiveDefiniteBlocks) {
  Random random(2);
  int slides = 0, sticks = 0;
  for (const double mu : {1e-6, 0.04, 0.3, 0.8, 3.0, 1e3, 1e12}) {
    for (int i = 0; i < 2000; ++i) {
      const Mat3 a = random.matrix();
      const Mat3 W = a * a.transpose() + 0.01 * Mat3::Identity();
      const Vec3 q = random.vector();
      const auto s = solve_local(local_block(W, mu), q, random.vector());
      expect_law(W, q, mu, s, 1e-9);
      slides += s.status == LocalStatus::slide;
      sticks += s.status == LocalStatus::stick;
    }
  }
  EXPECT_GT(slides, 2000);
  EXPECT_GT(sticks, 1000);
}

TEST(LocalLaw, HoldsForSlightlyUnsymmetricBlocks) {
  Random random(3);
  for (int i = 0; i < 5000; ++i) {
    const Mat3 a = random.matrix();
    const Mat3 W = a * a.transpose() + 0.01 * Mat3::Identity() + 2e-3 * random.matrix();
    const Vec3 q = random.vector();
    expect_law(W, q, 0.7, solve_local(local_block(W, 0.7), q, Vec3::Zero()), 1e-9);
  }
}

TEST(LocalLaw, HoldsForSingularBlocksWhoseVelocityIsInTheirRange) {
  Random random(4);
  for (int rank = 1; rank <= 2; ++rank) {
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Matrix<double, 3, Eigen::Dynamic> a = random.matrix().leftCols(rank);
      const Mat3 W = a * a.transpose();
      const Vec3 q = W * random.vector();
      const auto s = solve_local(local_block(W, 0.5), q, Vec3::Zero());
      expect_law(W, q, 0.5, s, 1e-7);
    }
  }
}

TEST(LocalLaw, HoldsWhateverTheUnits) {
  Random random(5);
  for (const double mass : {1e-12, 1.0, 1e12}) {
    for (const double speed : {1e-15, 1.0, 1e9}) {
      for (int i = 0; i < 200; ++i) {
        const Mat3 a = random.matrix();
        const Mat3 W = (a * a.transpose() + 0.01 * Mat3::Identity()) / mass;
        const Vec3 q = speed * random.vector();
        expect_law(W, q, 0.4, solve_local(local_block(W, 0.4), q, Vec3::Zero()), 1e-9);
      }
    }
  }
}

TEST(LocalLaw, HoldsWhenStickAndSlipMeet) {
  // q such that the sticking impulse lies on the cone itself, a little inside, and a little outside.
  Random random(6);
  for (int i = 0; i < 1000; ++i) {
    const Mat3 a = random.matrix();
    const Mat3 W = a * a.transpose() + 0.1 * Mat3::Identity();
    const double angle = random.uniform(0, 6.28), mu = 0.3;
    for (const double factor : {1 - 1e-12, 1.0, 1 + 1e-15, 1 + 1e-12}) {
      const Vec3 r(1, mu * factor * std::cos(angle), mu * factor * std::sin(angle));
      const Vec3 q = -W * r;
      if (q[0] >= 0) continue;
      expect_law(W, q, mu, solve_local(local_block(W, mu), q, Vec3::Zero()), 1e-9);
    }
  }
}

TEST(LocalLaw, FindsTheSlidingDirectionThatASearchOverAllAnglesFinds) {
  Random random(7);
  const double mu = 0.4;
  for (int i = 0; i < 100; ++i) {
    const Mat3 a = random.matrix();
    const Mat3 W = a * a.transpose() + 0.05 * Mat3::Identity();
    const Vec3 q(-random.uniform(0.1, 1), random.uniform(-3, 3), random.uniform(-3, 3));
    const auto s = solve_local(local_block(W, mu), q, Vec3::Zero());
    if (s.status != LocalStatus::slide) continue;
    double nearest = 1e300;
    for (int k = 0; k < 20000; ++k) {
      const double angle = 2 * M_PI * k / 20000;
      const Vec3 ray(1, mu * std::cos(angle), mu * std::sin(angle));
      const double rn = -q[0] / W.row(0).dot(ray);
      if (rn <= 0) continue;
      const Vec3 u = W * (rn * ray) + q;
      const double cross = u[1] * ray[2] - u[2] * ray[1], dot = u.tail<2>().dot(ray.tail<2>());
      if (dot <= 0 && std::abs(cross) <= 2e-3 * mu * u.norm())
        nearest = std::min(nearest, (rn * ray - s.r).norm());
    }
    EXPECT_LT(nearest, 0.02 * s.r.norm());
  }
}

TEST(LocalLaw, SaysSoWhenThereIsNoSolution) {
  // Nothing can stop an approach that no impulse changes.
  EXPECT_EQ(solve_local(local_block(Mat3::Zero(), 0.5), Vec3(-1, 0, 0), Vec3::Zero()).status,
            LocalStatus::failed);
  // Wedged: the only direction in which r grows without effect lies inside the cone, and q points against it.
  const Vec3 free(1, 0.2, 0);
  const Vec3 a = free.unitOrthogonal(), b = free.cross(a).normalized();
  const Mat3 W = a * a.transpose() + b * b.transpose();
  const auto s = solve_local(local_block(W, 0.5), Vec3(-1, 0, 0), Vec3(1, 0, 0));
  EXPECT_EQ(s.status, LocalStatus::failed);
  EXPECT_TRUE(s.r.allFinite());
}

TEST(LocalLaw, SolvesOrSaysSoForAnyMatrix) {
  Random random(8);
  int failed = 0, failed_with_stiffness = 0;
  for (int i = 0; i < 20000; ++i) {
    const Mat3 W = random.matrix();
    const Vec3 q = random.vector();
    const auto s = solve_local(local_block(W, 0.6), q, Vec3::Zero());
    ASSERT_TRUE(s.r.allFinite());
    if (s.status == LocalStatus::failed) {
      ++failed;
      failed_with_stiffness += W(0, 0) > 0;
    } else
      expect_law(W, q, 0.6, s, 1e-6);
  }
  // A quarter of these matrices have W_NN < 0 and an approach: no solution. Of the rest about 530 have none
  // that the quartic finds; the bracket alone leaves 680.
  EXPECT_LT(failed, 6000);
  EXPECT_LT(failed_with_stiffness, 600);
}

}  // namespace
}  // namespace talus::friction_cone_test
