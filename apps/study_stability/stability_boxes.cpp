/// Many grains between walls: plates, confining pressure, piles.

#include <fmt/format.h>

#include <cmath>
#include <numeric>
#include <utility>

#include "apps/study_stability/stability_scenes.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::stability {
namespace {

double total_mass(const Problem& of) {
  double sum = 0;
  for (std::size_t k = 0; k < of.bodies.size(); ++k) sum += of.bodies.mass(k);
  return sum;
}

/// Cells of touching grains that fill [0, n d]^3 exactly: every chain along an axis is straight.
void fill_with_lattice(Problem& made, int n) {
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        add_grain(made, radius * Vec3(2 * x + 1, 2 * y + 1, 2 * z + 1), radius, sphere_mass(radius));
}

/// A plate of `ratio` grain masses under its own weight.
void add_plate(Problem& made, double height, double ratio) {
  Wall& plate = add_wall(made, "plate", {0, 0, height}, -Vec3::UnitZ());
  plate.load = {.drive = WallDrive::force,
                .force = ratio * sphere_mass(radius) * earth,
                .mass = ratio * sphere_mass(radius)};
}

/// On n x n columns of n grains: the floor carries all, the columns share in a way that is not unique.
Problem plate_on_columns(int n, double ratio, int subdomains) {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  made.setup.decomposition.subdomains = subdomains;
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  fill_with_lattice(made, n);
  add_plate(made, 2 * radius * n, ratio);
  const double weight = earth * total_mass(made), load = made.setup.walls.back().load.force;
  made.truth = at_rest(wall_forces({{0, 0, weight + load}, {0, 0, -load}}));
  return made;
}

/// Grains deposited between smooth walls, at rest.
Problem pile(int count, double time_step, double mu) {
  Problem made = problem(time_step, {0, 0, -earth}, mu);
  const double base = 12 * radius;
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  for (int axis = 0; axis < 2; ++axis) {
    const Vec3 normal = Vec3::Unit(axis);
    add_wall(made, axis == 0 ? "x-" : "y-", Vec3::Zero(), normal);
    add_wall(made, axis == 0 ? "x+" : "y+", base * normal, -normal);
  }
  const std::vector<double> radii =
      draw_radii({.kind = SizeDistribution::Kind::uniform, .min = radius / 1.2, .max = 1.2 * radius},
                 static_cast<std::size_t>(count), 1);
  const std::vector<Vec3> centres = deposit(radii, base, base);
  for (std::size_t k = 0; k < radii.size(); ++k) add_grain(made, centres[k], radii[k], sphere_mass(radii[k]));
  return made;
}

double top_of(const Problem& made) {
  double top = 0;
  for (std::size_t k = 0; k < made.bodies.size(); ++k)
    top = std::max(top, made.bodies.x[k][2] + made.bodies.radius[k]);
  return top;
}

Problem plate_on_pile(int count, double ratio) {
  Problem made = pile(count, natural_dt, 0);
  add_plate(made, top_of(made), ratio);
  made.truth = reference_velocities();
  return made;
}

/// A cube of 4 x 4 x 4 grains that three walls press against three others, under gravity. The walls are
/// smooth, so that each carries what the one opposite does, in steps that begin at rest: rows of grains
/// buckle, and 5 % of a large pressure, which a step may leave, move the walls by metres per second.
Problem pressed_cube(double pressure, int subdomains) {
  constexpr int n = 4;
  const double edge = 2 * radius * n, force = pressure * edge * edge;
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  stage(made).laws.between(material_of_grains, material_of_walls).friction = 0;
  made.setup.decomposition.subdomains = subdomains;
  fill_with_lattice(made, n);
  add_box(made, Vec3::Constant(edge));
  std::vector<Vec3> exact;
  for (std::size_t w = 0; w < made.setup.walls.size(); ++w) {
    Wall& wall = made.setup.walls[w];
    if (w % 2 == 1) {
      wall.area = edge * edge;
      wall.load = {.drive = WallDrive::pressure, .pressure = pressure, .mass = total_mass(made)};
    }
    exact.push_back(force * wall.normal);
  }
  exact[4][2] += earth * total_mass(made);
  made.truth = at_rest(wall_forces(std::move(exact)));
  return made;
}

/// A large grain on three small ones of the same density, whose line of force from floor to grain lies within
/// both cones of friction: the three share its weight.
Problem tripod(double ratio) {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.5);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  const double r = radius, large = ratio * radius, tilt = 0.15;
  const double arm = (large + r) * std::sin(tilt);
  for (int k = 0; k < 3; ++k) {
    const double angle = 2.0943951023931953 * k;
    add_grain(made, {arm * std::cos(angle), arm * std::sin(angle), r}, r, sphere_mass(r));
  }
  add_grain(made, {0, 0, r + (large + r) * std::cos(tilt)}, large, sphere_mass(large));
  made.truth = at_rest(wall_forces({{0, 0, earth * total_mass(made)}}));
  return made;
}

}  // namespace

void add_boxes(std::vector<Scene>& table) {
  using enum Verdict;
  for (double ratio : {10.0, 100.0})
    table.push_back({fmt::format("radius-ratio-tripod-{}", ratio),
                     "a large grain on three small ones, held by friction: the floor carries all",
                     [ratio] { return tripod(ratio); },
                     ratio > 10 ? Verdicts{right, certified} : Verdicts{right}});
  for (double ratio : {1e2, 1e4, 1e6, 1e8})
    table.push_back({fmt::format("plate-columns-{:.0e}", ratio),
                     "a plate of so many grain masses on 6 x 6 columns of 6: floor and plate forces",
                     [ratio] { return plate_on_columns(6, ratio, 1); },
                     ratio > 1e4 ? Verdicts{right, certified, honest} : Verdicts{right}});
  table.push_back({"plate-columns-1e+06-subdomains-8",
                   "the same cut into 8 subdomains",
                   [] { return plate_on_columns(6, 1e6, 8); },
                   {right, certified, honest}});
  for (double ratio : {1e2, 1e4, 1e6})
    table.push_back({fmt::format("plate-pile-{:.0e}", ratio),
                     "a plate on 300 smooth grains as deposited: each step solved to 1e-10",
                     [ratio] { return plate_on_pile(300, ratio); }});
  for (double pressure : {1e-3, 1.0, 1e3, 1e6, 1e9})
    table.push_back({fmt::format("pressure-{:.0e}", pressure),
                     "64 grains pressed from three sides, under gravity: all six wall forces",
                     [pressure] { return pressed_cube(pressure, 1); }, Verdicts{right, honest}});
  // A cubic lattice with friction has answers without end, and its rows are about to buckle: some steps find
  // none to the digits that the check of small clusters wants, and say so.
  table.push_back({"pressure-1e+03-subdomains-8", "the same cut into 8 subdomains",
                   [] { return pressed_cube(1e3, 8); }, Verdicts{right, honest}});
  for (double factor : {1e-2, 1.0, 1e2})
    table.push_back(
        {fmt::format("time-step-pile-{:.0e}", factor),
         "300 smooth grains as deposited, at so many times the natural step: each step solved to 1e-10",
         [factor] {
           Problem made = pile(300, factor * natural_dt, 0);
           made.truth = reference_velocities();
           return made;
         },
         factor > 1 ? Verdicts{right, honest} : Verdicts{right}});
  for (double mu : {0.1, 1.0, 10.0})
    table.push_back({fmt::format("friction-pile-{}", mu),
                     "300 grains as deposited with that coefficient, 20 steps: the answer is not unique",
                     [mu] {
                       Problem made = pile(300, natural_dt, mu);
                       made.steps = 20;
                       return made;
                     },
                     {certified}});
}

}  // namespace talus::stability
