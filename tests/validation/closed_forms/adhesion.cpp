/// Work of adhesion: what touches holds up to 2 pi w_A l, l the reduced radius.

#include <gtest/gtest.h>

#include <numbers>

#include "tests/validation/experiment.hpp"

namespace talus::validation::closed_form_adhesion_test {
namespace {

constexpr double h = 1e-3, mass = 2, weight = mass * g_earth;

/// Grains of these radii that hang from a ceiling, one below the other, without friction.
Scene hanging(const std::vector<double>& radii) {
  Scene scene(h);
  scene.wall("ceiling", Vec3::Zero(), -Vec3::UnitZ());
  scene.stage().gravity = Vec3(0, 0, -g_earth);
  double z = 0;
  for (const double radius : radii) {
    scene.sphere({0, 0, z - radius}, radius, mass);
    z -= 2 * radius;
  }
  return scene;
}

/// How far the lowest grain falls in a second [m]: some metres, less the time in which a trifle parts it.
double fall(Scene scene) {
  Experiment run(std::move(scene));
  const auto lowest = static_cast<std::int64_t>(run.simulation().state().bodies.size()) - 1;
  const double before = run.x(lowest)[2];
  run.steps(1000);
  return before - run.x(lowest)[2];
}

TEST(Adhesion, BallHangsFromACeilingByItsRadius) {
  for (const double radius : {0.02, 0.1, 0.5})
    for (const double part : {0.999, 1.001}) {
      Scene scene = hanging({radius});
      scene.stage().laws.set_all(adhesion_attraction, part * weight / (2 * std::numbers::pi * radius));
      const double fallen = fall(std::move(scene));
      if (part > 1)
        EXPECT_LT(fallen, 1e-12) << radius;
      else
        EXPECT_GT(fallen, 1) << radius;
    }
}

TEST(Adhesion, UnequalGrainsPartByTheirReducedRadius) {
  const double big = 0.1, little = 0.04, reduced = big * little / (big + little);
  for (const double part : {0.999, 1.001}) {
    Scene scene = hanging({big, little});
    scene.stage().laws.set_all(adhesion_attraction, 1e3 * weight);
    LawNumber(adhesion_attraction).in(scene.stage().laws.between(material_of_grains, material_of_grains)) =
        part * weight / (2 * std::numbers::pi * reduced);
    const double fallen = fall(std::move(scene));
    if (part > 1)
      EXPECT_LT(fallen, 1e-12);
    else
      EXPECT_GT(fallen, 1);
  }
}

TEST(Adhesion, AddsToCohesion) {
  const double radius = 0.1, half = 0.501 * weight, adhesion = half / (2 * std::numbers::pi * radius);
  for (const auto& [cohesion, work, holds] :
       {std::tuple{half, adhesion, true}, {half, 0.0, false}, {0.0, adhesion, false}}) {
    Scene scene = hanging({radius});
    scene.stage().laws.set_all(cohesion_attraction, cohesion);
    scene.stage().laws.set_all(adhesion_attraction, work);
    EXPECT_EQ(fall(std::move(scene)) < 1e-12, holds) << cohesion << " N, " << work << " J/m²";
  }
}

}  // namespace
}  // namespace talus::validation::closed_form_adhesion_test
