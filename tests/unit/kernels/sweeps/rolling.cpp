/// Moments of rolling resistance at one contact of unequal grains, from torque and angular momentum alone.

#include "kernels/sweeps/rolling.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/unit/dense_sample.hpp"

namespace talus::rolling_test {
namespace {

using test::Random;
using test::uniform;
using test::uniform_vector;

/// Two grains, or a grain at a wall, with a normal impulse r_n and a moment in the tangent plane to start
/// from.
struct RollingContact {
  Contacts contacts;
  std::vector<double> radius, inertia;  // [m], [kg m^2]
  std::vector<Velocity> velocity;
  Vec3 n;
  double r_n;

  RollingContact(Random& random, bool wall, double arm) : velocity(2) {
    for (Velocity& v : velocity) {
      radius.push_back(uniform(random, 0.1, 2));
      const double mass = uniform(random, 0.1, 5);
      inertia.push_back(0.4 * mass * radius.back() * radius.back());
      v.inv_mass = 1 / mass;
      v.spin_mobility = 2.5 * v.inv_mass;  // R^2/I
      for (double& w : v.w) w = uniform(random, -1, 1);
    }
    n = uniform_vector(random, -1, 1).normalized();
    r_n = uniform(random, 0.1, 1);
    const Vec3 tangent = n.unitOrthogonal(), r = r_n * n + 0.2 * r_n * tangent, m = 0.1 * arm * r_n * tangent;
    contacts.nx = {n[0]}, contacts.ny = {n[1]}, contacts.nz = {n[2]};
    contacts.rx = {r[0]}, contacts.ry = {r[1]}, contacts.rz = {r[2]};
    contacts.mx = {m[0]}, contacts.my = {m[1]}, contacts.mz = {m[2]};
    contacts.first = {0};
    contacts.second = {wall ? -1 : 1};
    contacts.arm = {arm};
  }

  Vec3 omega(std::size_t body) const { return Eigen::Map<const Vec3>(velocity[body].w) / radius[body]; }
  Vec3 moment() const { return {contacts.mx[0], contacts.my[0], contacts.mz[0]}; }
  /// Of the first body against the second or the wall, without the part about the normal.
  Vec3 rolling_rate() const {
    const Vec3 rate = contacts.second[0] < 0 ? omega(0) : Vec3(omega(0) - omega(1));
    return rate - rate.dot(n) * n;
  }
  double error(Multiplicities parts = {}) const {
    ErrorSums sums;
    add_error_of_moments(contacts, {0, 1}, radius, velocity, parts, sums);
    EXPECT_EQ(sums.residual2, sums.residual_max2) << "of one contact";
    return std::sqrt(sums.residual2);
  }
};

TEST(RollingSweep, StopsTheRollingWithALargeArmAndElseActsAgainstItWithItsBound) {
  Random random(3);
  for (int trial = 0; trial < 200; ++trial)
    for (const bool wall : {false, true})
      for (const double arm : {100.0, 1e-3}) {
        RollingContact one(random, wall, arm);
        const Vec3 before[] = {one.omega(0), one.omega(1)}, m = one.moment();
        EXPECT_GT(one.error(), 1e-6);
        sweep_moments(one.contacts, {0, 1}, one.radius, one.velocity);
        const Vec3 change = one.moment() - m, rate = one.rolling_rate();
        EXPECT_LT((one.inertia[0] * (one.omega(0) - before[0]) - change).norm(), 1e-13) << "I d omega = dm";
        EXPECT_LT((one.inertia[1] * (one.omega(1) - before[1]) + (wall ? 0 : 1) * change).norm(), 1e-13);
        EXPECT_NEAR(one.moment().dot(one.n), 0, 1e-13) << "none about the normal";
        if (arm > 1) {
          EXPECT_LT(rate.norm(), 1e-13);
        } else {
          EXPECT_NEAR(one.moment().norm(), arm * one.r_n, 1e-15);
          EXPECT_NEAR(one.moment().dot(rate), -one.moment().norm() * rate.norm(), 1e-15) << "against it";
        }
        EXPECT_LT(one.error(), 1e-12);
      }
}

TEST(RollingSweep, ANormalImpulseThatPullsCarriesNoMoment) {
  Random random(4);
  RollingContact one(random, false, 100);
  for (auto* r : {&one.contacts.rx, &one.contacts.ry, &one.contacts.rz}) r->front() *= -1;
  sweep_moments(one.contacts, {0, 1}, one.radius, one.velocity);
  EXPECT_EQ(one.moment().norm(), 0);
}

TEST(RollingSweep, MomentsOfTheStepBeforeTurnBothBodies) {
  Random random(5);
  RollingContact one(random, false, 10);
  const Vec3 before[] = {one.omega(0), one.omega(1)};
  add_moments(one.contacts, {0, 1}, one.radius, one.velocity);
  EXPECT_LT((one.inertia[0] * (one.omega(0) - before[0]) - one.moment()).norm(), 1e-14);
  EXPECT_LT((one.inertia[1] * (one.omega(1) - before[1]) + one.moment()).norm(), 1e-14);
}

// What is left of the rolling, at the smaller grain's surface. A body in m parts has the mobility of the
// whole over m in each of them, and the error is that of the whole.
TEST(RollingError, IsTheSpeedOfRollingThatAContactCouldStopAndKnowsWholeBodies) {
  Random random(6);
  RollingContact one(random, false, 100);
  const double speed = std::min(one.radius[0], one.radius[1]) * one.rolling_rate().norm();
  EXPECT_NEAR(one.error(), speed, 1e-12);
  // A copy carries M/m: its mobility is m times that of the whole.
  RollingContact bound = one;
  bound.contacts.arm = {1e-4};
  const double whole = bound.error();
  for (Velocity& v : bound.velocity) v.spin_mobility *= 3, v.inv_mass *= 3;
  const std::vector<std::remove_const_t<Multiplicities::element_type>> parts = {3, 3};
  EXPECT_NEAR(bound.error(parts), whole, 1e-12);
  EXPECT_GT(bound.error(), 2 * whole) << "of the parts it is larger";
}

}  // namespace
}  // namespace talus::rolling_test
