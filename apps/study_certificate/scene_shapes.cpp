/// Families of scenes with walls that are no planes, that move by themselves, or that hold grains.

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "apps/study_certificate/scene_bench.hpp"
#include "apps/study_certificate/step_walls.hpp"

namespace talus::audit {

namespace {

/// Passes in which a grain comes down on walls; each brings it as far as it is from the nearest.
constexpr int most_passes = 300;
/// Of the radius: so near to a wall is on it, and an overlap by less is none.
constexpr double on_wall = 1e-12, overlap_allowed = 1e-9;

/// Distance of a sphere's surface from the nearest wall, at most its radius [m].
double clearance(const std::vector<StepWall>& walls, const Vec3& x, double r) {
  double least = r;
  for (const StepWall& wall : walls)
    for (const WallTouch& touch : wall.touches(x, 2 * r, wall.placed(0)))
      least = std::min(least, touch.distance - r);
  return least;
}

/// Deep in a solid a sphere touches nothing.
bool in_solid(const SceneBench& bench, const Vec3& x) {
  return std::ranges::any_of(bench.made.scene.setup.walls, [&](const Wall& wall) {
    return wall.surface() != nullptr && wall.surface()->depth(x) > 0;
  });
}

/// Lets grains down along z from places between `low` and `high`, on walls and on one another; those that
/// find no room are left out.
void pour(SceneBench& bench, int grains, const Vec3& low, const Vec3& high) {
  std::vector<StepWall> walls;
  for (const Wall& wall : bench.made.scene.setup.walls) walls.emplace_back(wall, 0, 0);
  Draws& draws = bench.draws;
  for (int tries = 0; static_cast<int>(bench.count()) < grains && tries < 50 * grains; ++tries) {
    const double r = bench.draw_radius();
    Vec3 x(draws.between(low[0], high[0]), draws.between(low[1], high[1]), draws.between(low[2], high[2]));
    if (in_solid(bench, x) || !(clearance(walls, x, r) > 0)) continue;
    for (int pass = 0; pass < most_passes && x[2] > low[2]; ++pass) {
      const double room = clearance(walls, x, r);
      if (room < on_wall * r) break;
      x[2] -= room;
    }
    bench.drop(x[0], x[1], r, x[2] - r);
    Sample& made = bench.made.grains;
    const Vec3& there = made.x.back();
    if (there[2] <= high[2] && !in_solid(bench, there) && clearance(walls, there, r) > -overlap_allowed * r)
      continue;
    made.x.pop_back(), made.radius.pop_back(), made.velocity.pop_back();
  }
}

Wall& add_surface(SceneBench& bench, const std::string& name, WallShape shape) {
  Wall& wall = bench.add_wall(name, Vec3::Zero(), Vec3::UnitZ());
  wall.normal.setZero();
  make_surface(shape);
  wall.shape = std::move(shape);
  return wall;
}

WallShape shape_of(const std::string& name, std::map<std::string, std::vector<double>> numbers) {
  WallShape shape;
  shape.name = name;
  shape.values.number = std::move(numbers);
  return shape;
}

std::vector<double> numbers_of(const Vec3& v) {
  return {v[0], v[1], v[2]};
}

/// What walls may turn about.
struct Axle {
  Vec3 axis, point;  ///< of any length; [m]
  double arm;        ///< [m] where the speed is that of the scene
};

/// Gives walls one motion, or none in a quarter of the scenes: they turn about the axle, swing by up to a
/// third of a radius, or both.
void move(SceneBench& bench, const std::vector<std::string>& names, const Axle& axle) {
  Draws& draws = bench.draws;
  const double speed = bench.speed_of_fall() * draws.between_decades(1e-3, 3), kind = draws.unit();
  if (kind < 0.25) return;
  std::vector<MotionPart> motion;
  if (kind < 0.8)
    motion.push_back(rotation_part(axle.axis, axle.point, (draws.chance(0.5) ? 1 : -1) * speed / axle.arm));
  if (kind > 0.65) {
    const Vec3 direction = draws.direction();
    const double amplitude = bench.radius * draws.between_decades(1e-3, 0.3),
                 frequency = speed / (2 * std::numbers::pi * amplitude);
    motion.push_back(
        oscillation_part(direction, amplitude, frequency, draws.between(0, 2 * std::numbers::pi)));
  }
  bench.wall_speed = std::max(bench.wall_speed, speed);
  for (Wall& wall : bench.made.scene.setup.walls)
    if (std::ranges::find(names, wall.name) != names.end()) wall.motion = motion;
}

/// Two triangles of a rectangle whose corners go counterclockwise.
void add_rectangle(const std::array<Vec3, 4>& corner, std::vector<Triangle>& triangles) {
  triangles.push_back({corner[0], corner[1], corner[2]});
  triangles.push_back({corner[0], corner[2], corner[3]});
}

/// A prism about the y axis.
std::vector<Triangle> prism(int sides, double radius, double length) {
  std::vector<Triangle> triangles;
  const auto corner = [&](int k, double y) {
    const double angle = 2 * std::numbers::pi * k / sides;
    return Vec3(radius * std::sin(angle), y, radius * std::cos(angle));
  };
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides;
    add_rectangle({corner(k, 0), corner(next, 0), corner(next, length), corner(k, length)}, triangles);
    triangles.push_back({Vec3::Zero(), corner(next, 0), corner(k, 0)});
    triangles.push_back({Vec3(0, length, 0), corner(k, length), corner(next, length)});
  }
  return triangles;
}

/// The prism of triangles, as a scene's mesh.
WallShape mesh_of(std::vector<Triangle> triangles, const std::string& file, bool inside) {
  WallShape shape;
  shape.name = "mesh";
  shape.values.file = file;
  shape.values.triangles = std::move(triangles);
  if (inside) shape.values.number["inside"] = {1};
  return shape;
}

}  // namespace

void make_drum(SceneBench& bench) {
  Draws& draws = bench.draws;
  const double wide = bench.radius * draws.between(2.5, 8), length = bench.radius * draws.between(2.5, 7);
  const Vec3 end(0, length, 0);
  const bool rings = draws.chance(0.3);  // ends that are discs, which turn along
  add_surface(bench, "shell",
              shape_of("cylinder", {{"start", numbers_of(Vec3::Zero())},
                                    {"end", numbers_of(end)},
                                    {"radius", {wide}},
                                    {"inside", {1}}}));
  for (const bool far : {false, true}) {
    const std::string name = far ? "y+" : "y-";
    const Vec3 at = far ? end : Vec3::Zero(), axis = Vec3::UnitY();
    if (rings)
      add_surface(bench, name,
                  shape_of("disc", {{"centre", numbers_of(at)}, {"axis", {0, 1, 0}}, {"radius", {wide}}}));
    else
      bench.add_wall(name, at, far ? Vec3(-axis) : axis);
  }
  pour(bench, bench.draw_count(3, 110), {-wide, 0, -wide}, {wide, length, 0.9 * wide});
  move(bench, {"shell", rings ? "y+" : "", draws.chance(0.5) ? "y-" : ""},
       {Vec3::UnitY(), Vec3::Zero(), wide});
}

void make_hopper(SceneBench& bench) {
  Draws& draws = bench.draws;
  const double outlet = draws.chance(0.3) ? 0 : bench.radius * draws.between(0.5, 3);
  const double wide = outlet + bench.radius * draws.between(2, 7),
               high = (wide - outlet) * draws.between(0.3, 3);
  add_surface(bench, "cone",
              shape_of("cone", {{"start", {0, 0, 0}},
                                {"end", {0, 0, high}},
                                {"start_radius", {outlet}},
                                {"end_radius", {wide}},
                                {"inside", {1}}}));
  add_surface(bench, "tube",
              shape_of("cylinder", {{"start", {0, 0, high}},
                                    {"end", {0, 0, 3 * high + 20 * bench.radius}},
                                    {"radius", {wide}},
                                    {"inside", {1}}}));
  if (outlet > 0 && draws.chance(0.6)) bench.add_wall("plug", Vec3::Zero(), Vec3::UnitZ());
  pour(bench, bench.draw_count(2, 110), {-wide, -wide, 0}, {wide, wide, 2.9 * high + 17 * bench.radius});
  move(bench, {"cone", draws.chance(0.5) ? "tube" : "", draws.chance(0.5) ? "plug" : ""},
       {Vec3::UnitZ(), Vec3::Zero(), wide});
}

void make_paddle(SceneBench& bench) {
  Draws& draws = bench.draws;
  const double base = bench.radius * draws.between(4, 9), lift = base * draws.between(0.1, 0.4);
  bench.add_box(base);
  // Grains lie on and beside what moves, and it stands in the box without touching its walls.
  const double side = base * draws.between(0.2, 0.35), kind = draws.unit();
  const Vec3 middle(base / 2, base / 2, lift);
  Vec3 axis = Vec3::UnitY();
  if (kind < 0.3) {
    add_surface(bench, "paddle",
                shape_of("rectangle", {{"corner", numbers_of(middle - Vec3(side, side, 0))},
                                       {"edge_a", {2 * side, 0, 0}},
                                       {"edge_b", {0, 2 * side, 0}}}));
  } else if (kind < 0.5) {
    axis = Vec3(0.2, 0.1, 1);
    add_surface(
        bench, "paddle",
        shape_of("disc", {{"centre", numbers_of(middle)}, {"axis", {0.3, 0, 1}}, {"radius", {side}}}));
  } else if (kind < 0.75) {
    add_surface(bench, "paddle",
                shape_of("cylinder", {{"start", numbers_of(middle - Vec3(0, side, 0))},
                                      {"end", numbers_of(middle + Vec3(0, side, 0))},
                                      {"radius", {0.9 * lift}}}));
  } else {
    axis = Vec3::UnitZ();
    add_surface(bench, "paddle",
                shape_of("cone", {{"start", numbers_of(middle)},
                                  {"end", numbers_of(middle + Vec3(0, 0, side))},
                                  {"start_radius", {side}},
                                  {"end_radius", {draws.chance(0.5) ? 0 : side / 2}}}));
  }
  pour(bench, bench.draw_count(2, 110), {0, 0, 0}, {base, base, 4 * base});
  move(bench, {"paddle"}, {axis, middle, side});
}

void make_mesh_drum(SceneBench& bench) {
  Draws& draws = bench.draws;
  const double wide = bench.radius * draws.between(4, 9), length = bench.radius * draws.between(2.5, 7);
  add_surface(bench, "shell",
              mesh_of(prism(draws.from_to(3, 9), wide, length), bench.made.name() + ".stl", true));
  Vec3 axis = Vec3::UnitY();
  if (draws.chance(0.4)) {  // an obstacle, with edges and corners that face the grains
    const double small = bench.radius * draws.between(0.7, 1.5);
    std::vector<Triangle> block = prism(draws.from_to(3, 5), small, length / 2);
    for (Triangle& triangle : block)
      for (Vec3& p : triangle) p += Vec3(0.1 * wide, length / 4, -0.2 * wide);
    add_surface(bench, "block", mesh_of(std::move(block), bench.made.name() + "-block.stl", false));
    axis = Vec3(0.1, 1, 0.2);
  }
  pour(bench, bench.draw_count(2, 110), {-wide, 0, -wide}, {wide, length, 0.9 * wide});
  move(bench, {draws.chance(0.7) ? "shell" : "block"}, {axis, {0, length / 2, 0}, wide});
}

void make_shaken(SceneBench& bench) {
  Draws& draws = bench.draws;
  const double base = bench.radius * draws.between(4, 9);
  bench.add_box(base);
  pour(bench, bench.draw_count(3, 120), {0, 0, 0}, {base, base, 10 * base});
  std::vector<std::string> names;
  for (const char* name : {"z-", "x-", "x+", "y-", "y+"})
    if (draws.chance(0.7)) names.emplace_back(name);
  move(bench, names, {draws.direction(), {base / 2, base / 2, 0}, base});
  Wall& floor = bench.made.scene.setup.walls.front();
  if (!floor.motion.empty() && draws.chance(0.5)) return;
  MotionPart belt;
  if (draws.chance(0.5))
    belt.velocity = Vec3(draws.unit(), draws.unit(), 0) * bench.speed_of_fall();
  else
    belt = rotation_part(Vec3::UnitZ(), {base / 2, base / 2, 0}, bench.speed_of_fall() / base);
  belt.surface_only = true;
  floor.motion.push_back(belt);
}

void make_sticky(SceneBench& bench) {
  const double kind = bench.draws.unit();
  if (kind < 0.4)
    make_flight(bench);
  else if (kind < 0.7)
    make_press(bench);
  else
    make_drum(bench);
  bench.cohesion = bench.weight() * bench.draws.between_decades(0.1, 1e3);
}

}  // namespace talus::audit
