/// The same scene in other units, whose answer must scale, and scenes that make no sense.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "apps/study_stability/stability_scenes.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::stability {
namespace {

/// What one metre, kilogram and second are called.
struct Units {
  double metre = 1, kilogram = 1, second = 1;
};

/// 60 grains with friction under a pressed lid, falling together and coming to rest.
Problem pressed_pile(const Units& unit) {
  const double acceleration = unit.metre / unit.second / unit.second, force = unit.kilogram * acceleration;
  const double base = 6 * radius;
  Problem made = problem(natural_dt * unit.second, {0, 0, -earth * acceleration}, 0.35);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  for (int axis = 0; axis < 2; ++axis) {
    const Vec3 normal = Vec3::Unit(axis);
    add_wall(made, axis == 0 ? "x-" : "y-", Vec3::Zero(), normal);
    add_wall(made, axis == 0 ? "x+" : "y+", base * unit.metre * normal, -normal);
  }
  const std::vector<double> radii =
      draw_radii({.kind = SizeDistribution::Kind::uniform, .min = radius / 1.2, .max = 1.2 * radius}, 60, 1);
  const std::vector<Vec3> centres = deposit(radii, base, base);
  double top = 0, mass = 0;
  for (std::size_t k = 0; k < radii.size(); ++k) {
    add_grain(made, centres[k] * unit.metre, radii[k] * unit.metre, sphere_mass(radii[k]) * unit.kilogram);
    top = std::max(top, centres[k][2] + radii[k]);
    mass += sphere_mass(radii[k]);
  }
  Wall& lid = add_wall(made, "lid", {0, 0, top * unit.metre}, -Vec3::UnitZ());
  lid.area = base * base * unit.metre * unit.metre;
  lid.load = {.drive = WallDrive::pressure,
              .pressure = 1e3 * force / (unit.metre * unit.metre),
              .mass = mass * unit.kilogram};
  made.steps = 5;
  return made;
}

/// The first steps of the pile in SI units.
std::vector<Frame> usual_steps(const SolverSettings& solver, int count) {
  Problem usual = pressed_pile({});
  usual.setup.solver = solver;
  graph::Executor executor({.threads = 1});
  Simulation simulation(usual.setup, std::move(usual.bodies), executor);
  std::vector<Frame> steps;
  for (int k = 0; k < count; ++k) {
    simulation.step();
    steps.push_back(simulation.frame(false));
  }
  return steps;
}

/// Places, velocities and spins of all grains against those in SI units, over a radius and over what gravity
/// gives in a step. Units that are powers of two, of which square roots are too, change no digit: any
/// difference is a number in the solver that has a unit. Other factors change what rounding decides, such as
/// the check at which a step ends, and with it all that the tolerance leaves open.
Problem in_units(const Units& unit) {
  Problem made = pressed_pile(unit);
  made.allowed = 1e-15;  // nothing, whatever --tolerance is
  made.truth = {[unit, count = made.steps,
                 usual = std::vector<Frame>()](const StepView& step) mutable -> std::optional<double> {
    if (usual.empty()) usual = usual_steps(step.simulation.setup().solver, count);
    const Frame& should = usual[static_cast<std::size_t>(step.after.step - 1)];
    double error = 0, speed = 0;
    for (std::size_t k = 0; k < should.x.size(); ++k) {
      error = std::max(error, (step.after.x[k] / unit.metre - should.x[k]).norm() / radius);
      speed = std::max(speed, (step.after.u[k] * (unit.second / unit.metre) - should.u[k]).norm());
      speed =
          std::max(speed, should.radius[k] * (step.after.omega[k] * unit.second - should.omega[k]).norm());
    }
    return std::max(error, speed / (natural_dt * earth));
  }};
  return made;
}

/// One grain at rest, for a defect to be put in. Any claim of success is wrong.
Problem nonsense() {
  Problem made = problem(natural_dt, {0, 0, -earth}, 0.35);
  add_wall(made, "floor", Vec3::Zero(), Vec3::UnitZ());
  add_grain(made, {0, 0, radius}, radius, sphere_mass(radius));
  made.truth = {[](const StepView&) -> std::optional<double> { return 1; }};
  return made;
}

}  // namespace

void add_units(std::vector<Scene>& table) {
  const std::string asks = "60 grains with friction under a lid, in units so many times the usual";
  for (int power : {-20, 20}) {
    const double factor = std::ldexp(1, power);
    const auto add = [&](const char* what, const Units& unit) {
      table.push_back({fmt::format("units-{}-2^{}", what, power), asks, [unit] { return in_units(unit); }});
    };
    add("length", {.metre = factor});
    add("mass", {.kilogram = factor});
    add("time", {.second = factor});
  }
}

void add_nonsense(std::vector<Scene>& table) {
  const auto add = [&](const char* name, const char* asks, std::function<void(Problem&)> spoil) {
    table.push_back({name,
                     asks,
                     [spoil = std::move(spoil)] {
                       Problem made = nonsense();
                       spoil(made);
                       return made;
                     },
                     {Verdict::refused}});
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  add("nonsense-centre", "a centre is not a number", [](Problem& p) { p.bodies.x[0][0] = nan; });
  add("nonsense-speed", "a velocity is infinite", [](Problem& p) { p.bodies.velocity[0].u[1] = infinity; });
  add("nonsense-gravity", "gravity is not a number", [](Problem& p) { stage(p).gravity[2] = nan; });
  add("nonsense-friction", "a friction coefficient is not a number",
      [](Problem& p) { stage(p).laws.between(material_of_grains, material_of_walls).friction = nan; });
  add("nonsense-friction-infinite", "a friction coefficient is infinite",
      [](Problem& p) { stage(p).laws.between(material_of_grains, material_of_walls).friction = infinity; });
  add("nonsense-time-step", "the time step is 0", [](Problem& p) { stage(p).time_step = 0; });
  add("nonsense-time-step-infinite", "the time step is infinite",
      [](Problem& p) { stage(p).time_step = infinity; });
  add("nonsense-wall", "a wall stands nowhere", [](Problem& p) { p.setup.walls[0].point[2] = nan; });
  add("nonsense-load", "a wall is pushed by what is not a number",
      [](Problem& p) { p.setup.walls[0].load = {.drive = WallDrive::force, .force = nan, .mass = 1}; });
  add("nonsense-wall-mass", "a pushed wall has no mass",
      [](Problem& p) { p.setup.walls[0].load = {.drive = WallDrive::force, .force = 1, .mass = 0}; });
  add("nonsense-tolerance", "the tolerance is not a number",
      [](Problem& p) { p.setup.solver.tolerance = nan; });
}

}  // namespace talus::stability
