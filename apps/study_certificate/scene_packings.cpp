/// Families of packings: deposited, pressed, in flight, on a lattice, in a funnel.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "apps/study_certificate/scene_bench.hpp"

namespace talus::audit {

namespace {

/// Deposits about `grains` on a base of a few diameters; returns its length [m].
double deposit_grains(SceneBench& bench, int grains) {
  const double base = bench.radius * bench.draws.between(4, 9);
  std::vector<double> radii;
  for (int k = 0; k < grains; ++k) radii.push_back(bench.draw_radius());
  const std::vector<Vec3> centres = deposit(radii, base, base);
  for (std::size_t k = 0; k < centres.size(); ++k) bench.add(centres[k], radii[k]);
  return base;
}

void push(SceneBench& bench, const std::string& name, double load) {
  for (Wall& wall : bench.made.scene.setup.walls)
    if (wall.name == name)
      wall.load = {.drive = WallDrive::force,
                   .force = load,
                   .mass = bench.weight() / (bench.gravity > 0 ? bench.gravity : 9.81) *
                           bench.draws.between_decades(1e-2, 1e4)};
}

}  // namespace

void make_deposition(SceneBench& bench) {
  bench.add_box(deposit_grains(bench, bench.draw_count(5, 150)));
  if (bench.gravity == 0) bench.add_wall("z+", {0, 0, bench.top()}, -Vec3::UnitZ());
}

void make_press(SceneBench& bench) {
  const double base = deposit_grains(bench, bench.draw_count(5, 120));
  bench.add_box(base);
  const double load = bench.weight() * bench.draws.between_decades(1, 1e3);
  bench.add_lid(load);
  if (bench.draws.chance(0.6)) push(bench, "x+", load);
  if (bench.draws.chance(0.6)) push(bench, "y+", load);
}

void make_flight(SceneBench& bench) {
  Draws& draws = bench.draws;
  if (draws.chance(0.7)) bench.gravity = 0;
  if (bench.speed == 0) bench.speed = std::sqrt(9.81 * bench.radius) * draws.between_decades(1e-2, 10);
  const int clusters = draws.from_to(1, 4);
  for (int k = 0; k < clusters; ++k)
    bench.add_cluster(bench.draw_count(2, 35), Vec3(25.0 * k * bench.radius, 0, 0));
  if (draws.chance(0.3)) {
    double low = 0;
    for (std::size_t k = 0; k < bench.count(); ++k)
      low = std::min(low, bench.made.grains.x[k][2] - bench.made.grains.radius[k]);
    bench.add_wall("floor", {0, 0, low}, Vec3::UnitZ());
  }
}

void make_lattice(SceneBench& bench) {
  Draws& draws = bench.draws;
  const int nx = draws.from_to(1, 5), ny = draws.from_to(1, 5), nz = bench.draw_count(1, 6);
  const double r = bench.radius;
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) bench.add({(2 * x + 1) * r, (2 * y + 1) * r, (2 * z + 1) * r}, r);
  bench.add_wall("z-", Vec3::Zero(), Vec3::UnitZ());
  bench.add_wall("x-", Vec3::Zero(), Vec3::UnitX());
  bench.add_wall("x+", {2 * nx * r, 0, 0}, -Vec3::UnitX());
  bench.add_wall("y-", Vec3::Zero(), Vec3::UnitY());
  bench.add_wall("y+", {0, 2 * ny * r, 0}, -Vec3::UnitY());
  if (draws.chance(0.7)) bench.add_lid(bench.weight() * draws.between_decades(1, 1e3));
}

void make_funnel(SceneBench& bench) {
  Draws& draws = bench.draws;
  const int walls = draws.from_to(3, 8);
  const double slope = draws.between(0.2, 1.5);  // of the normals, upwards
  for (int k = 0; k < walls; ++k) {
    const double angle = 2 * std::numbers::pi * k / walls;
    bench.add_wall("wall-" + std::to_string(k), Vec3::Zero(), {std::cos(angle), std::sin(angle), slope});
  }
  const int grains = bench.draw_count(1, 100);
  const double widest = bench.radius * draws.between(0.5, 4);
  for (int k = 0; k < grains; ++k) {
    const double r = bench.draw_radius(), angle = draws.between(0, 2 * std::numbers::pi);
    const double out = k == 0 ? 0 : widest * std::sqrt(draws.unit());
    const double x = out * std::cos(angle), y = out * std::sin(angle);
    double floor = 0;
    for (const Wall& wall : bench.made.scene.setup.walls)
      floor = std::max(floor, (r - wall.normal[0] * x - wall.normal[1] * y) / wall.normal[2] - r);
    bench.drop(x, y, r, floor);
  }
}

}  // namespace talus::audit
