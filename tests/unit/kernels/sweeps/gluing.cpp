/// Copies of a body or a wall that are glued after a sweep.

#include <gtest/gtest.h>

#include <numeric>

#include "kernels/sweeps/sweep.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::gluing_test {
namespace {

using test::Random;
using test::uniform;

const test::ReferenceSweeps reference;
constexpr double eps = 2.3e-16;

TEST(Gluing, ConservesMomentumForAnyMultiplicity) {
  Random random(7);
  for (std::size_t copies = 1; copies <= 40; ++copies) {
    const double inv_mass = static_cast<double>(copies) / 3.7;
    std::vector<WallCopy> all(copies + 2);  // two that belong to another wall
    for (WallCopy& copy : all) {
      for (double& v : copy.velocity) v = uniform(random, -1, 1);
      copy.inv_mass = inv_mass;
    }
    const Vec3 other(all[1].velocity);
    std::vector<std::int32_t> which;
    for (std::size_t k = 0; k < copies + 2; ++k)
      if (k != 1 && k != copies + 1) which.push_back(static_cast<std::int32_t>(k));
    Vec3 before = Vec3::Zero(), after = Vec3::Zero();
    for (std::int32_t k : which) before += Vec3(all[static_cast<std::size_t>(k)].velocity) / inv_mass;
    glue_copies(all, which);
    for (std::int32_t k : which) {
      after += Vec3(all[static_cast<std::size_t>(k)].velocity) / inv_mass;
      EXPECT_EQ(Vec3(all[static_cast<std::size_t>(k)].velocity),
                Vec3(all[static_cast<std::size_t>(which[0])].velocity))
          << "copies agree to the bit";
    }
    EXPECT_LE((after - before).norm(), 10 * eps * 3.7);
    EXPECT_EQ(Vec3(all[1].velocity), other);
  }
}

// A piston of mass M at speed V sweeps up N grains at rest: plastic impact, everything then moves with
// M V / (M + sum m), however many copies the piston was split into.
TEST(Gluing, OfASplitWallConvergesToTheUnsplitVelocity) {
  constexpr int grains = 60;
  constexpr double wall_mass = 20, speed = 2;
  Random random(11);
  Contacts contacts;
  std::vector<Velocity> at_rest(grains);
  double mass = wall_mass;
  for (int k = 0; k < grains; ++k) {
    Velocity& v = at_rest[static_cast<std::size_t>(k)];
    v.inv_mass = uniform(random, 0.5, 5);
    v.spin_mobility = 2.5 * v.inv_mass;
    mass += 1 / v.inv_mass;
    for (auto* zero : {&contacts.nx, &contacts.ny, &contacts.bias, &contacts.rx, &contacts.ry, &contacts.rz})
      zero->push_back(0);
    contacts.nz.push_back(1);
    contacts.first.push_back(k);
    contacts.second.push_back(-1);
  }
  const double expected = speed * wall_mass / mass;
  for (std::size_t copies : {1, 2, 7, 60}) {
    Contacts own = contacts;
    std::vector<Velocity> velocity = at_rest;
    std::vector<WallCopy> wall(copies);
    std::vector<std::int32_t> which(copies);
    std::iota(which.begin(), which.end(), 0);
    for (WallCopy& copy : wall) {
      copy.velocity[2] = speed;
      copy.inv_mass = static_cast<double>(copies) / wall_mass;
    }
    for (int sweep = 0; sweep < 1000; ++sweep) {
      for (std::size_t c = 0; c < copies; ++c)
        reference.sweep_wall<true>(own, {grains * c / copies, grains * (c + 1) / copies}, velocity, 0.3,
                                   wall[c]);
      glue_copies(wall, which);
    }
    EXPECT_NEAR(wall[0].velocity[2], expected, 1e-10) << copies << " copies";
    for (const Velocity& v : velocity) EXPECT_NEAR(v.u[2], expected, 1e-10) << copies << " copies";
  }
}

}  // namespace
}  // namespace talus::gluing_test
