/// Numbers that no product of masses has a place for: ADMM refuses them, and touches no memory of others.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "kernels/global/admm.hpp"
#include "kernels/global/body_system.hpp"

namespace talus {
namespace {

/// Grains in a row on a floor, under a lid of finite mass; h = 1 ms. All masses times `unit`.
BodyProblem lidded_row(double unit, double lid) {
  constexpr int grains = 40;
  BodyProblem problem;
  const auto touch = [&](std::int32_t first, std::int32_t second) {
    ContactEquation contact;
    contact.normal = Vec3::UnitZ();
    contact.offset = Vec3::Zero();
    contact.mu = 0.3;
    contact.first = first;
    contact.second = second;
    problem.contacts.push_back(contact);
  };
  for (int k = 0; k < grains; ++k) {
    BodyUnknown body;
    body.mass = unit;
    body.spin_mass = 0.4 * unit;
    body.radius = 0.01;
    body.x = Vec3(0.02 * k, 0, 0.01);
    body.free.u = Vec3(0, 0, -1e-2);
    problem.bodies.push_back(body);
    touch(k, -1);
    if (k > 0) touch(k, k - 1);
    touch(k, grains);
  }
  problem.grains = grains;
  BodyUnknown wall;
  wall.mass = lid * unit;
  wall.kind = BodyKind::wall;
  wall.axis = -Vec3::UnitZ();
  wall.free.u = Vec3(0, 0, -1e-2);
  problem.bodies.push_back(wall);
  problem.impulse.assign(problem.contacts.size(), Vec3::Zero());
  return problem;
}

TEST(AdmmExtremes, MassesWithoutPlaceInADoubleAreRefused) {
  for (const double unit : {1.0, 1e-150, 1e-300, 1e-308, 1e150, 1e300})
    for (int digits = 0; digits < 308; ++digits) {
      BodyProblem problem = lidded_row(unit, std::pow(10.0, digits));
      EXPECT_LE(solve_admm(problem, {}).iterations, BodyAdmmSettings{}.max_iterations);
    }
}

// A body that has contacts and no group in the coarse level made an index of -1.
TEST(AdmmExtremes, BodyWithContactsIsTouchedWhateverTheirWeights) {
  const BodyProblem problem = lidded_row(1, 10);
  for (const double weight : {std::numeric_limits<double>::quiet_NaN(), 0.0, 1.0}) {
    BodySystem system(problem, std::vector<double>(problem.contacts.size(), weight));
    system.close();
    for (const char touched : system.touched()) EXPECT_TRUE(touched) << weight;
  }
}

}  // namespace
}  // namespace talus
