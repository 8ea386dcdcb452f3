/// Several materials in one scene: each contact follows the law of its own pair.

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_materials_test {
namespace {

/// Gives the bodies these materials, in the order in which they were added.
void give(Scene& scene, std::vector<Material> materials, std::size_t of_all) {
  scene.bodies.material = std::move(materials);
  scene.stage().laws = PairTable(of_all);
}

// Blocks side by side on one slope, in one chunk: one holds, one slides as its own friction says.
TEST(Materials, OnOneSlopeEachGrainSlidesOrRestsByTheFrictionOfItsOwnPair) {
  const double angle = 0.4, slippery = 0.1, rough = 0.8;
  Scene scene(1e-3);
  scene.slope(angle);
  scene.setup.rotation = false;
  for (int k = 0; k < 20; ++k) scene.sphere({0, 0.3 * k, 0.1}, 0.1, 2);
  std::vector<Material> materials;
  for (int k = 0; k < 20; ++k) materials.push_back(k % 2 == 0 ? 0 : 1);
  give(scene, materials, 3);
  scene.setup.walls[0].material = 2;
  scene.stage().laws.between(0, 2).friction = slippery;
  scene.stage().laws.between(2, 1).friction = rough;
  Experiment run(std::move(scene));
  run.steps(300);
  for (int k = 0; k < 20; ++k) {
    const double slides = g_earth * (std::sin(angle) - slippery * std::cos(angle)) * 0.3;
    EXPECT_NEAR(run.u(k)[0], k % 2 == 0 ? slides : 0, 1e-11) << k;
  }
}

TEST(Materials, PairsOfOneChunkReboundWithTheirOwnRestitution) {
  const double u = 1.5;
  Scene scene(1e-3);
  std::vector<Material> materials;
  // Equal grains of pair (k mod 2, k div 2 mod 2) meet head on.
  for (int k = 0; k < 12; ++k) {
    scene.sphere({-0.12, 0.5 * k, 0}, 0.1, 2, {u, 0, 0});
    scene.sphere({0.12, 0.5 * k, 0}, 0.1, 2, {-u, 0, 0});
    materials.push_back(static_cast<Material>(k % 2));
    materials.push_back(static_cast<Material>(k / 2 % 2));
  }
  give(scene, materials, 2);
  const double e[3] = {0.2, 0.5, 0.9};  // (0, 0), (0, 1), (1, 1)
  for (std::size_t k = 0; k < 3; ++k) scene.stage().laws.laws()[k].restitution = e[k];
  Experiment run(std::move(scene));
  run.steps(60);
  for (int k = 0; k < 12; ++k) {
    const double expected = e[k % 2 + k / 2 % 2] * u;
    EXPECT_NEAR(run.u(2 * k)[0], -expected, 1e-11) << k;
    EXPECT_NEAR(run.u(2 * k + 1)[0], expected, 1e-11) << k;
  }
}

// A restitution of 0 beside others is inelastic to the last digit, as where all have 0.
TEST(Materials, APairWithoutRestitutionStopsWhereItsNeighboursRebound) {
  Scene scene(1e-3);
  scene.wall("floor", Vec3::Zero(), Vec3::UnitZ()).material = 0;
  scene.sphere({0, 0, 0.11}, 0.1, 1, {0, 0, -2});
  scene.sphere({1, 0, 0.11}, 0.1, 1, {0, 0, -2});
  give(scene, {0, 1}, 2);
  scene.stage().laws.between(0, 1).restitution = 0.7;
  Experiment run(std::move(scene));
  run.steps(30);
  EXPECT_NEAR(run.u(0)[2], 0, 1e-12);
  EXPECT_NEAR(run.u(1)[2], 1.4, 1e-12);
}

// With all numbers equal, that materials have names changes no bit.
TEST(Materials, ThatDifferInNameOnlyChangeNoBit) {
  const auto digest = [](bool named) {
    Scene scene(1e-3);
    scene.slope(0.2);
    scene.setup.solver.tolerance = 1e-4;
    for (int k = 0; k < 60; ++k)
      scene.sphere({0.19 * (k % 5), 0.19 * (k / 5 % 3), 0.1 + 0.19 * (k / 15)}, 0.1, 1);
    if (named) {
      for (int k = 0; k < 60; ++k) scene.bodies.material.push_back(static_cast<Material>(k % 3));
      scene.setup.walls[0].material = 1;
    }
    scene.stage().laws = PairTable(named ? 3 : 2, {.friction = 0.3, .restitution = 0.2});
    Experiment run(std::move(scene));
    run.steps(80);
    return run.simulation().digest();
  };
  EXPECT_EQ(digest(false), digest(true));
}

TEST(Materials, ThatTheLawsOfAStageDoNotHaveAreRefused) {
  Scene of_body(1e-3), of_wall(1e-3);
  of_body.sphere({0, 0, 1}, 0.1, 1);
  of_body.bodies.material = {2};
  EXPECT_THROW(Experiment{std::move(of_body)}, std::invalid_argument);
  of_wall.sphere({0, 0, 1}, 0.1, 1);
  of_wall.wall("floor", Vec3::Zero(), Vec3::UnitZ()).material = 2;
  EXPECT_THROW(Experiment{std::move(of_wall)}, std::invalid_argument);
}

}  // namespace
}  // namespace talus::validation::closed_form_materials_test
