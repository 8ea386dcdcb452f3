#pragma once

/// Small scenes that the tests of whole simulations share.

#include <string>
#include <utility>
#include <vector>

#include "tests/unit/dense_sample.hpp"

namespace talus::simulation_test {

inline constexpr double radius = 0.01, density = 2600;

/// edge_x x edge_y x edge_z spheres of 8-10 mm on a cubic lattice of 21 mm in a box, ids in lattice order.
inline Bodies loose_sample(int edge_x, int edge_y, int edge_z, std::uint64_t seed) {
  test::Random random(seed);
  Bodies bodies;
  for (int k = 0; k < edge_x * edge_y * edge_z; ++k) {
    const Vec3 site(k % edge_x + 0.5, k / edge_x % edge_y + 0.5, k / (edge_x * edge_y) + 0.5);
    add_sphere(bodies, BodyId{k}, 2.1 * radius * site + test::uniform_vector(random, -0.04, 0.04) * radius,
               radius * test::uniform(random, 0.8, 1), density);
  }
  return bodies;
}

/// Edge of a cell that 6 x 6 x 6 of them fill [m].
inline constexpr double cell_edge = 6 * 2.1 * radius;

/// 216 of these grains that fly about, from places moved by `shift` [m].
inline Sample flying(const Vec3& shift = Vec3::Zero()) {
  const Bodies bodies = loose_sample(6, 6, 6, 11);
  test::Random random(12);
  Sample sample;
  sample.density = density;
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    sample.x.push_back(bodies.x[k] + shift);
    sample.radius.push_back(bodies.radius[k]);
    const Vec3 u = test::uniform_vector(random, -0.5, 0.5);
    sample.velocity.push_back({u[0], u[1], u[2], 0, 0, 0});
  }
  return sample;
}

inline std::vector<Wall> box(double x, double y, double z) {
  std::vector<Wall> walls = test::box_of_walls(0, 0);
  walls[1].point = Vec3(x, 0, 0);
  walls[3].point = Vec3(0, y, 0);
  walls[5].point = Vec3(0, 0, z);
  return walls;
}

inline WallLoad pressed(double pressure) {
  WallLoad load;
  load.drive = WallDrive::pressure;
  load.pressure = pressure;
  load.mass = 1;
  return load;
}

inline Stage stage(std::string name, std::int64_t steps) {
  Stage stage;
  stage.name = std::move(name);
  stage.time_step = 1e-3;
  stage.end.steps = steps;
  return stage;
}

inline Setup falling(std::int64_t steps) {
  talus::Setup setup;
  setup.stages = {stage("fall", steps)};
  setup.stages[0].gravity = Vec3(0, 0, -10);
  return setup;
}

}  // namespace talus::simulation_test
