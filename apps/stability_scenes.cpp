#include "apps/stability_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

namespace talus::stability {

Problem problem(double time_step, const Vec3& gravity, double mu) {
  Problem made;
  Stage only;
  only.name = "all";
  only.time_step = time_step;
  only.gravity = gravity;
  only.law.mu_grains = only.law.mu_walls = mu;
  only.end.steps = std::numeric_limits<std::int64_t>::max();
  made.setup.stages.push_back(std::move(only));
  return made;
}

Stage& stage(Problem& problem) {
  return problem.setup.stages.front();
}

Wall& add_wall(Problem& problem, std::string name, const Vec3& point, const Vec3& normal) {
  Wall wall;
  wall.name = std::move(name);
  wall.point = point;
  wall.normal = normal.normalized();
  return problem.setup.walls.emplace_back(std::move(wall));
}

void add_box(Problem& problem, const Vec3& lengths) {
  const char* names[] = {"x-", "x+", "y-", "y+", "z-", "z+"};
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 normal = Vec3::Unit(axis);
    add_wall(problem, names[2 * axis], Vec3::Zero(), normal);
    add_wall(problem, names[2 * axis + 1], lengths[axis] * normal, -normal);
  }
}

double sphere_mass(double r) {
  return density * 4 / 3 * std::numbers::pi * r * r * r;
}

Velocity& add_grain(Problem& problem, const Vec3& centre, double r, double mass) {
  const double volume = 4.0 / 3 * std::numbers::pi * r * r * r;
  add_sphere(problem.bodies, BodyId{static_cast<std::int64_t>(problem.bodies.size())}, centre, r,
             mass / volume);
  return problem.bodies.velocity.back();
}

Truth wall_forces(std::vector<Vec3> exact) {
  return [exact = std::move(exact)](const StepView& step) -> std::optional<double> {
    double error = 0, scale = 0;
    const std::vector<WallReport> walls = step.simulation.walls();
    for (std::size_t w = 0; w < exact.size(); ++w) {
      error = std::max(error, (walls[w].force - exact[w]).norm());
      scale = std::max(scale, exact[w].norm());
    }
    return error / scale;
  };
}

Truth at_rest(Truth truth) {
  return [truth = std::move(truth)](const StepView& step) -> std::optional<double> {
    const double most = step.time_step() * step.gravity().norm() / 20;
    const auto rests = [&](const Vec3& u) { return u.norm() <= most; };
    if (!std::all_of(step.before.u.begin(), step.before.u.end(), rests)) return std::nullopt;
    return truth(step);
  };
}

Truth reference_velocities(const Problem& of) {
  Setup setup = of.setup;
  setup.solver.method = SolverMethod::nncg;
  setup.solver.tolerance = 1e-10;
  setup.solver.balance_tolerance = 1e-8;
  setup.solver.max_iterations = 50000;
  graph::Executor executor({.threads = 1});
  Simulation reference(setup, of.bodies, executor);
  const bool known = reference.step().converged;
  return [known, exact = reference.frame(false),
          bodies = of.bodies](const StepView& step) -> std::optional<double> {
    if (!known || step.after.step != 1) return std::nullopt;
    const double h = step.time_step();
    double error = 0, change = 0;  // ids count from 0, so frames and `bodies` have one order
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      const Vec3 free = Eigen::Map<const Vec3>(bodies.velocity[k].u) + h * step.gravity();
      error += bodies.mass(k) * (step.after.u[k] - exact.u[k]).norm();
      change += bodies.mass(k) * (exact.u[k] - free).norm();
    }
    const std::vector<Wall>& walls = step.simulation.setup().walls;
    const std::vector<WallReport> reports = step.simulation.walls();
    for (std::size_t w = 0; w < walls.size(); ++w) {
      if (walls[w].inv_mass() == 0) continue;
      const double free =
          walls[w].velocity.dot(walls[w].normal) + h * walls[w].load.force * walls[w].inv_mass();
      error += std::abs(reports[w].velocity - exact.walls[w].velocity) / walls[w].inv_mass();
      change += std::abs(exact.walls[w].velocity - free) / walls[w].inv_mass();
    }
    return error / change;
  };
}

std::vector<Scene> scenes() {
  std::vector<Scene> table;
  add_columns(table);
  add_boxes(table);
  add_wedges_and_arches(table);
  add_motion(table);
  add_units(table);
  add_nonsense(table);
  return table;
}

}  // namespace talus::stability
