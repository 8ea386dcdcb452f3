/// Walls that meet and grains jammed between them; arches, whose line of thrust is known.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "apps/study_stability/stability_scenes.hpp"

namespace talus::stability {
namespace {

/// At rest all walls together carry `weight` [N]; how they share it is not unique. Over the weight.
Truth walls_carry(double weight) {
  const auto sum_of_forces = [weight](const StepView& step) -> std::optional<double> {
    Vec3 sum(0, 0, -weight);
    for (const WallReport& wall : step.simulation.walls()) sum += wall.force;
    return sum.norm() / weight;
  };
  return {sum_of_forces, TruthFrom::rest};
}

/// One smooth grain between fixed walls: what each must give to stop what comes in and to let no gap of the
/// middle of the step become an overlap, by projected sweeps. Largest error over the largest force or the
/// weight.
Truth forces_on_smooth_grain() {
  return {[](const StepView& step) -> std::optional<double> {
    const std::vector<Wall>& walls = step.simulation.setup().walls;
    const double h = step.time_step(), mass = step.simulation.state().bodies.mass(0);
    const double weight = mass * step.gravity().norm();
    const Vec3 middle = step.before.x[0] + h / 2 * step.before.u[0];
    Vec3 u = step.before.u[0] + h * step.gravity();
    std::vector<double> gained(walls.size(), 0.0);  // by each wall [m/s]
    for (double change = 1; change > 1e-12 * h * step.gravity().norm();) {
      change = 0;
      for (std::size_t w = 0; w < walls.size(); ++w) {
        const Vec3& n = walls[w].normal;
        const double gap = std::max(0.0, n.dot(middle - walls[w].point) - step.before.radius[0]);
        const double before = gained[w];
        gained[w] = std::max(0.0, before - n.dot(u) - gap / h);
        u += (gained[w] - before) * n;
        change = std::max(change, std::abs(gained[w] - before));
      }
    }
    double error = 0, scale = weight;
    const std::vector<WallReport> reports = step.simulation.walls();
    for (std::size_t w = 0; w < walls.size(); ++w) {
      const Vec3 exact = mass * gained[w] / h * walls[w].normal;
      error = std::max(error, (reports[w].force - exact).norm());
      scale = std::max(scale, exact.norm());
    }
    return error / scale;
  }};
}

/// A grain between two walls that meet below it, each `half_angle` from the vertical.
Problem wedge(double half_angle, double mu) {
  Problem made = problem(natural_dt, {0, 0, -earth}, mu);
  const double c = std::cos(half_angle), s = std::sin(half_angle);
  add_wall(made, "left", Vec3::Zero(), {c, 0, s});
  add_wall(made, "right", Vec3::Zero(), {-c, 0, s});
  add_grain(made, {0, 0, radius / s}, radius, sphere_mass(radius));
  made.truth = mu > 0 ? walls_carry(earth * sphere_mass(radius)) : forces_on_smooth_grain();
  return made;
}

/// A grain driven into the wedge by a lid of `ratio` grain masses.
Problem driven_wedge(double half_angle, double ratio) {
  Problem made = wedge(half_angle, 0);
  const double weight = earth * sphere_mass(radius), load = ratio * weight;
  const double s = std::sin(half_angle), force = (weight + load) / (2 * s);
  Wall& lid = add_wall(made, "lid", {0, 0, radius / s + radius}, -Vec3::UnitZ());
  lid.load = {.drive = WallDrive::force, .force = load, .mass = ratio * sphere_mass(radius)};
  const double side = force * std::cos(half_angle), up = force * s;
  made.truth = wall_forces({{side, 0, up}, {-side, 0, up}, {0, 0, -load}});
  return made;
}

/// Three walls meet at right angles and gravity points into their corner.
Problem corner() {
  Problem made = problem(natural_dt, Vec3::Constant(-earth / std::sqrt(3.0)), 0);
  for (int axis = 0; axis < 3; ++axis)
    add_wall(made, fmt::format("wall-{}", axis), Vec3::Zero(), Vec3::Unit(axis));
  add_grain(made, Vec3::Constant(radius), radius, sphere_mass(radius));
  made.truth = forces_on_smooth_grain();
  return made;
}

/// `count` walls in a ring meet below one grain: as many unknown forces for three equations.
Problem funnel(int count) {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * 3.14159265358979324 * k / count;
    add_wall(made, fmt::format("wall-{}", k), Vec3::Zero(), {std::cos(angle), std::sin(angle), 0.5});
  }
  add_grain(made, {0, 0, radius * std::sqrt(1.25) / 0.5}, radius, sphere_mass(radius));
  made.truth = walls_carry(earth * sphere_mass(radius));
  return made;
}

/// Grains along their own line of thrust between two walls at right angles to it: thrust T_k = (H, 0, V_k)
/// from grain k - 1 to grain k, V falling by a weight per grain. It springs at `angle` [rad]: a small one
/// makes a nearly straight chain.
Problem arch(int count, double mu, double angle = 1.0471975511965977) {
  Problem made = problem(natural_dt, {0, 0, -earth}, mu);
  const double weight = earth * sphere_mass(radius), half = 0.5 * count * weight;
  const double horizontal = half / std::tan(angle);
  const auto thrust = [&](int k) { return Vec3(horizontal, 0, half - k * weight); };
  Vec3 x = Vec3::Zero();
  std::map<std::pair<std::int64_t, std::int64_t>, double> exact;  // by bodies in order
  add_wall(made, "left", -radius * thrust(0).normalized(), thrust(0));
  for (int k = 0; k < count; ++k) {
    if (k > 0) x += 2 * radius * thrust(k).normalized();
    add_grain(made, x, radius, sphere_mass(radius));
    exact[{k == 0 ? -1 : k - 1, k}] = thrust(k).norm();
  }
  add_wall(made, "right", x + radius * thrust(count).normalized(), -thrust(count));
  exact[{-2, count - 1}] = thrust(count).norm();
  if (mu > 0) {
    made.truth = walls_carry(count * weight);
    return made;
  }
  const auto thrusts = [exact](const StepView& step) -> std::optional<double> {
    auto missing = exact;
    double largest = 0, error = 0;
    for (std::size_t k = 0; k < step.after.contact_force.size(); ++k) {
      const auto [first, second] = step.after.contact_bodies[k];
      missing[{std::min(first, second), std::max(first, second)}] -= step.after.contact_force[k].norm();
    }
    for (const auto& [bodies, force] : exact) largest = std::max(largest, force);
    for (const auto& [bodies, force] : missing) error = std::max(error, std::abs(force));
    return error / largest;
  };
  made.truth = {thrusts, TruthFrom::rest};
  return made;
}

/// A grain on four floors in one place: how they share its weight nothing tells.
Problem floors() {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0);
  for (int k = 0; k < 4; ++k) add_wall(made, fmt::format("floor-{}", k), Vec3::Zero(), Vec3::UnitZ());
  add_grain(made, {0, 0, radius}, radius, sphere_mass(radius));
  made.truth = walls_carry(earth * sphere_mass(radius));
  return made;
}

/// A lid driven down onto a grain on the floor at a speed that nothing stops: no impulse satisfies both
/// walls.
Problem crush() {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  add_grain(made, {0, 0, radius}, radius, sphere_mass(radius));
  add_wall(made, "lid", {0, 0, 2 * radius}, -Vec3::UnitZ()).load = {.drive = WallDrive::velocity,
                                                                    .velocity = {0, 0, -0.1}};
  made.truth = {[](const StepView&) -> std::optional<double> { return 1; }};
  return made;
}

/// A pushed lid falls onto a floor with nothing between: walls do not feel one another.
Problem walls_cross() {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  add_wall(made, "lid", {0, 0, radius}, -Vec3::UnitZ()).load = {
      .drive = WallDrive::force, .force = 1e3, .mass = 1};
  made.steps = 40;
  made.truth = {[](const StepView& step) -> std::optional<double> {
    const double lid = -step.simulation.walls()[1].position;
    return lid < 0 ? std::optional<double>(1) : std::nullopt;
  }};
  return made;
}

}  // namespace

void add_wedges_and_arches(std::vector<Scene>& table) {
  for (double angle : {0.3, 0.1, 0.01, 0.001})
    table.push_back({fmt::format("wedge-{}", angle),
                     "a smooth grain in a wedge of that half angle [rad]: both wall forces",
                     [angle] { return wedge(angle, 0); }});
  for (double mu : {0.4, 10.0})
    table.push_back({fmt::format("wedge-jammed-{}", mu),
                     "the same at 0.1 rad with that friction, self-locking: the sum of the wall forces",
                     [mu] { return wedge(0.1, mu); }});
  for (double ratio : {1e2, 1e6})
    table.push_back({fmt::format("wedge-driven-{:.0e}", ratio),
                     "a grain driven into a wedge of 0.1 rad by a lid of so many grain masses",
                     [ratio] { return driven_wedge(0.1, ratio); }});
  table.push_back({"walls-corner", "a grain in the corner of three walls: each force", corner});
  table.push_back({"walls-funnel-12", "a grain in a ring of 12 walls with friction: their sum",
                   [] { return funnel(12); }});
  table.push_back(
      {"walls-crush", "a driven wall crushes a grain: there is no solution", crush, {Verdict::honest}});
  table.push_back({"walls-cross",
                   "a pushed wall meets the floor: nothing holds walls apart",
                   walls_cross,
                   {Verdict::refused}});
  for (int count : {9, 40})
    table.push_back({fmt::format("arch-{}", count), "a smooth arch along its line of thrust: each thrust",
                     [count] { return arch(count, 0); }});
  for (double angle : {0.1, 0.01})
    table.push_back({fmt::format("chain-20-{}", angle),
                     "an arch that springs at so small an angle [rad], a nearly straight chain: each thrust",
                     [angle] { return arch(20, 0, angle); }});
  table.push_back({"floors-4", "a grain on four floors in one place: their sum", floors});
  table.push_back({"arch-40-hyperstatic", "the same with friction 0.5: the sum of the wall forces",
                   [] { return arch(40, 0.5); }});
}

}  // namespace talus::stability
