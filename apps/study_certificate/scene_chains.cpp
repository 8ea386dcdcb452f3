/// Families in which forces run along lines: columns, chains, wedges, arches, rows, heavy on light.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/study_certificate/scene_bench.hpp"

namespace talus::audit {

namespace {

void stack(SceneBench& bench, int grains, double x, double y) {
  double z = 0;
  for (int k = 0; k < grains; ++k) {
    const double r = bench.draw_radius();
    bench.add({x, y, z + r}, r);
    z += 2 * r;
  }
}

double some_load(SceneBench& bench) {
  return bench.weight() * bench.draws.between_decades(1, 1e3);
}

}  // namespace

void make_column(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.speed = draws.chance(0.8) ? 0 : bench.speed;
  stack(bench, bench.draw_count(1, 150), 0, 0);
  bench.add_wall("floor", Vec3::Zero(), Vec3::UnitZ());
  if (draws.chance(0.3)) bench.add_lid(some_load(bench));
}

void make_among(SceneBench& bench) {
  bench.speed = 0;
  const int tall = bench.draw_count(5, 60), singles = bench.draw_count(10, 90);
  stack(bench, tall, 0, 0);
  for (int k = 0; k < singles; ++k) {
    const double r = bench.draw_radius();
    bench.add({3 * bench.radius * (1 + k % 10), 3 * bench.radius * (1 + k / 10), r}, r);
  }
  bench.add_wall("floor", Vec3::Zero(), Vec3::UnitZ());
}

void make_chain(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.speed = 0;
  const double r = bench.radius, bend = draws.between_decades(1e-4, 0.5);
  const int grains = bench.draw_count(2, 80);
  // Each link leans by `bend` to one side or the other of the line between the walls, so that gravity, or
  // the pushed wall, presses on a chain that is hardly bent.
  double x = r, z = 0;
  for (int k = 0; k < grains; ++k) {
    bench.add({x, 0, z}, r);
    const double lean = bend * (k % 2 == 0 ? 1 : -1) * draws.between(0.5, 1);
    x += 2 * r * std::cos(lean);
    z += 2 * r * std::sin(lean);
  }
  const double end = bench.made.grains.x.back()[0] + r;
  bench.add_wall("x-", Vec3::Zero(), Vec3::UnitX());
  Wall& last = bench.add_wall("x+", {end, 0, 0}, -Vec3::UnitX());
  if (draws.chance(0.4))
    last.load = {.drive = WallDrive::force,
                 .force = some_load(bench),
                 .mass = bench.weight() / 9.81 * draws.between_decades(1e-1, 1e4)};
  if (!draws.chance(0.7)) return;
  double low = INFINITY, high = -INFINITY;
  for (const Vec3& centre : bench.made.grains.x) {
    low = std::min(low, centre[2] - r);
    high = std::max(high, centre[2] + r);
  }
  bench.add_wall("z-", {0, 0, low}, Vec3::UnitZ());
  if (draws.chance(0.4)) bench.add_wall("z+", {0, 0, high}, -Vec3::UnitZ());
}

void make_wedge(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.speed = 0;
  const double a = draws.between_decades(1e-3, 0.5), c = std::cos(a), s = std::sin(a), r = bench.radius;
  bench.add_wall("left", Vec3::Zero(), {c, 0, s});
  bench.add_wall("right", Vec3::Zero(), {-c, 0, s});
  const int grains = bench.draw_count(1, 60);
  const double spacing = draws.chance(0.5) ? 2 * r : 4 * r, height = r / s;
  const bool stacked = draws.chance(0.3);
  for (int k = 0; k < grains; ++k) {
    if (stacked && k >= (grains + 1) / 2) {  // a second layer, between two of the first
      const double half = spacing / 2, rise = std::sqrt(std::max(0.0, 4 * r * r - half * half));
      bench.add({0, spacing * (k - (grains + 1) / 2) + half, height + rise}, r);
    } else {
      bench.add({0, spacing * k, height}, r);
    }
  }
  if (draws.chance(0.2)) bench.add_lid(some_load(bench));
}

void make_landing(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.speed = 0;
  bench.jams = true;
  const double a = draws.between_decades(3e-3, 0.1), s = std::sin(a);
  bench.add_wall("left", Vec3::Zero(), {std::cos(a), 0, s});
  bench.add_wall("right", Vec3::Zero(), {-std::cos(a), 0, s});
  const Vec3 down = -draws.between_decades(1, 100) * bench.speed_of_fall() * Vec3::UnitZ();
  double y = 0;
  for (int k = bench.draw_count(1, 20); k > 0; --k) {
    const double r = bench.draw_radius();
    bench.add_moving({0, y + r, r / s}, r, down);
    y += 2 * r;
  }
  const double large = 10 * bench.radius;  // far above the others, as a is small
  if (draws.chance(0.3)) bench.add_moving({0, 0, large / s}, large, 3 * down);
}

void make_arch(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.speed = 0;
  const double r = bench.radius, rise = draws.between(0.05, 1.2);  // half the angle that the arch spans
  const int grains = bench.draw_count(3, 40), loose = bench.draw_count(0, 100);
  const double lift = 4 * r;
  // Links turn evenly from +rise to -rise.
  double x = 0, z = lift;
  for (int k = 0; k < grains; ++k) {
    bench.add({x, 0, z}, r);
    const double angle = rise * (1 - (2.0 * k + 1) / (grains - 1));
    x += 2 * r * std::cos(angle);
    z += 2 * r * std::sin(angle);
  }
  double lean = rise * draws.between(0.7, 1.2);
  const Vec3 first = bench.made.grains.x.front(), last = bench.made.grains.x.back();
  const double middle = 0.5 * (first[0] + last[0]);
  // Under a high arch of few grains leaning walls may meet above the floor, where loose grains lie.
  while ((Vec3(middle, 0, 0.5 * r) - first).dot(Vec3(std::cos(lean), 0, std::sin(lean))) < -r) lean *= 0.9;
  const double c = std::cos(lean), s = std::sin(lean);
  bench.add_wall("left", first - r * Vec3(c, 0, s), {c, 0, s});
  bench.add_wall("right", last - r * Vec3(-c, 0, s), {-c, 0, s});
  bench.add_wall("floor", Vec3::Zero(), Vec3::UnitZ());
  const bool on_top = draws.chance(0.3);
  for (int k = 0; k < loose; ++k) {
    const double own = bench.draw_radius();
    if (on_top)
      bench.drop(draws.between(first[0], last[0]), 0, own, lift);
    else
      bench.add({middle, r * (10 + 2.1 * k), own}, own);
  }
}

void make_rows(SceneBench& bench) {
  Draws& draws = bench.draws;
  if (draws.chance(0.8)) bench.gravity = 0;
  const double speed = std::sqrt(9.81 * bench.radius) * draws.between_decades(1e-2, 10);
  const int rows = draws.from_to(1, 8), grains = bench.draw_count(2, 150 / rows);
  const double gap = draws.chance(0.7) ? 0 : bench.radius * draws.between_decades(1e-4, 0.1);
  const double lean = draws.chance(0.5) ? 0 : draws.between_decades(1e-4, 0.3);
  for (int row = 0; row < rows; ++row) {
    double x = 0, before = 0;
    for (int k = 0; k < grains; ++k) {
      const double r = bench.draw_radius();
      if (k > 0) x += (before + r) * std::cos(lean) + gap;
      const double side = k % 2 == 0 ? 0 : (before + r) * std::sin(lean);
      bench.add_moving({x, 3 * bench.radius * row, bench.radius + side}, r,
                       {k < grains / 2 ? speed : -speed, 0, 0});
      before = r;
    }
  }
  if (bench.gravity > 0) bench.add_wall("floor", Vec3::Zero(), Vec3::UnitZ());
}

void make_heavy(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.speed = 0;
  const double r = bench.radius, big = r * draws.between(2, 15);
  const int across = draws.from_to(1, 4), layers = bench.draw_count(1, 5);
  for (int z = 0; z < layers; ++z)
    for (int y = 0; y < across; ++y)
      for (int x = 0; x < across; ++x) bench.add({(2 * x + 1) * r, (2 * y + 1) * r, (2 * z + 1) * r}, r);
  const double base = 2 * across * r;
  bench.add_box(base);
  auto& walls = bench.made.scene.setup.walls;
  if (draws.chance(0.5)) {  // a plate that fills the box: a pushed wall of large mass
    const double mass = bench.weight() / (bench.gravity > 0 ? bench.gravity : 9.81);
    Wall& lid = bench.add_wall("z+", {0, 0, bench.top()}, -Vec3::UnitZ());
    const double ratio = draws.between_decades(10, 1e6);
    lid.load = {.drive = WallDrive::force, .force = ratio * bench.weight(), .mass = ratio * mass};
    return;
  }
  walls.resize(1);  // the floor alone: the sphere is wider than the box
  bench.drop(base * draws.between(0.3, 0.7), base * draws.between(0.3, 0.7), big, 0);
}

void make_boulder(SceneBench& bench) {
  Draws& draws = bench.draws;
  const double r = bench.radius, big = r * draws.between_decades(5, 1000);
  const int grains = bench.draw_count(1, 25);
  const double base = 2 * r * draws.between(1, 4);
  bench.add_wall("z-", Vec3::Zero(), Vec3::UnitZ());
  if (draws.chance(0.6)) bench.add_wall("x+", {base, 0, 0}, -Vec3::UnitX());
  for (int k = 0; k < grains; ++k) {
    const double own = bench.draw_radius();
    bench.drop(base - own - draws.unit() * (base - 2 * own), base * draws.between(-0.5, 0.5), own, 0);
  }
  // It comes along the floor, or just above it, until it touches the first grain.
  const double above = draws.chance(0.6) ? 0 : r * draws.between_decades(1e-9, 1e-2), z = big + above;
  double place = INFINITY;
  for (std::size_t k = 0; k < bench.count(); ++k) {
    const Vec3& x = bench.made.grains.x[k];
    const double reach = big + bench.made.grains.radius[k], beside = z - x[2];
    place = std::min(place, x[0] - std::sqrt(std::max(0.0, reach * reach - beside * beside - x[1] * x[1])));
  }
  const double speed = draws.chance(0.5) ? 0 : bench.speed_of_fall() * draws.between_decades(1e-6, 1e-2);
  bench.add_moving({place, 0, z}, big, speed * Vec3(draws.between(-1, 1), draws.between(-1, 1), 0));
}

namespace {

/// It would be in the way of grains that are added above.
void remove_lid(SceneBench& bench) {
  std::erase_if(bench.made.scene.setup.walls, [](const Wall& wall) { return wall.name == "z+"; });
}

}  // namespace

void make_apart(SceneBench& bench) {
  Draws& draws = bench.draws;
  const double kind = draws.unit();
  if (kind < 0.4)
    make_column(bench);
  else if (kind < 0.7)
    make_among(bench);
  else
    make_rows(bench);
  const double r = bench.radius * draws.between_decades(0.5, 30);
  const Vec3 u(bench.speed_of_fall() * draws.between_decades(0.1, 1e3), 0, 0);
  remove_lid(bench);
  const Vec3 above(0, 0, bench.top() + 3 * r);
  bench.add_moving(above - Vec3(r, 0, 0), r, u);
  bench.add_moving(above + Vec3(r, 0, 0), r, -u);
}

void make_touching(SceneBench& bench) {
  Draws& draws = bench.draws;
  draws.chance(0.5) ? make_column(bench) : make_among(bench);
  remove_lid(bench);
  const auto& grains = bench.made.grains;
  std::size_t top = 0;
  for (std::size_t k = 1; k < grains.x.size(); ++k)
    if (grains.x[k][2] > grains.x[top][2]) top = k;
  const double beside = grains.radius[top], r = beside * draws.between_decades(0.05, 1);
  const Vec3 at_its_height = grains.x[top] - Vec3(beside + r, 0, 0);
  const Vec3 u(0, 0, bench.speed_of_fall() * draws.between_decades(0.1, 1e3));
  bench.add_moving(at_its_height, r, u);
  bench.add_moving(at_its_height + Vec3(0, 0, 2 * r), r, -u);
}

/// A beam that one wall holds, or a heap.
void make_rolling(SceneBench& bench) {
  Draws& draws = bench.draws;
  bench.rolling = draws.between_decades(1e-3, 1);
  const double R = bench.radius;
  if (draws.chance(0.4)) {
    bench.speed = 0;
    bench.cohesion = bench.weight() * draws.between_decades(1, 1e4);
    double x = 0;
    for (int k = bench.draw_count(1, 30); k > 0; --k) {
      const double r = bench.draw_radius();
      bench.add({x + r, 0, 0}, r);
      x += 2 * r;
    }
    bench.add_wall("x-", Vec3::Zero(), Vec3::UnitX());
    return;
  }
  const double base = R * draws.between(2.2, 10);
  for (int k = bench.draw_count(1, 80); k > 0; --k)
    bench.drop(draws.between(R, base - R), draws.between(R, base - R), bench.draw_radius(), 0);
  bench.add_box(base);
  if (draws.chance(0.3)) bench.add_lid(some_load(bench));
  if (draws.chance(0.3)) bench.cohesion = bench.weight() * draws.between_decades(1e-2, 1e2);
}

}  // namespace talus::audit
