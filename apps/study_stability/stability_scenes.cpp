#include "apps/study_stability/stability_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace talus::stability {

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::right:
      return "right";
    case Verdict::certified:
      return "certified";
    case Verdict::honest:
      return "honest";
    case Verdict::refused:
      return "refused";
    case Verdict::wrong:
      return "WRONG";
    case Verdict::failed:
      return "FAILED";
  }
  return "";
}

Problem problem(double time_step, const Vec3& gravity, double mu) {
  Problem made;
  Stage only;
  only.name = "all";
  only.time_step = time_step;
  only.gravity = gravity;
  only.laws.set_all(&PairLaw::friction, mu);
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
  const auto largest = [exact = std::move(exact)](const StepView& step) -> std::optional<double> {
    double error = 0, scale = 0;
    const std::vector<WallReport> walls = step.simulation.walls();
    for (std::size_t w = 0; w < exact.size(); ++w) {
      error = std::max(error, (walls[w].force - exact[w]).norm());
      scale = std::max(scale, exact[w].norm());
    }
    return error / scale;
  };
  return {largest, TruthFrom::rest};
}

Truth at_rest(Truth truth) {
  const auto where_it_rests = [error =
                                   std::move(truth.error)](const StepView& step) -> std::optional<double> {
    const double tolerance = step.simulation.setup().solver.tolerance;
    const double most = 50 * tolerance * step.time_step() * step.gravity().norm();
    const auto rests = [&](const Vec3& u) { return u.norm() <= most; };
    if (!std::all_of(step.before.u.begin(), step.before.u.end(), rests)) return std::nullopt;
    return error(step);
  };
  return {where_it_rests, truth.from, "the others begin in motion"};
}

Truth reference_velocities() {
  const auto error_of_momentum = [](const StepView& step) -> std::optional<double> {
    Setup setup = step.simulation.setup();
    setup.solver.method = SolverMethod::nncg;
    setup.solver.tolerance = 1e-10;
    setup.solver.balance_tolerance = 1e-8;
    setup.solver.max_iterations = 50000;
    graph::Executor executor({.threads = 1});
    const SavedState& start = step.start.value();
    Simulation reference(setup, start, executor);
    if (!reference.step().converged) return std::nullopt;
    const Frame exact = reference.frame(false);
    const double h = step.time_step();
    double error = 0, change = 0;
    for (std::size_t s = 0; s < start.bodies.size(); ++s) {
      const auto k = static_cast<std::size_t>(start.bodies.id[s]);  // ids count from 0: the order of frames
      error += start.bodies.mass(s) * (step.after.u[k] - exact.u[k]).norm();
      change += start.bodies.mass(s) * (exact.u[k] - step.before.u[k] - h * step.gravity()).norm();
    }
    for (std::size_t w = 0; w < start.walls.size(); ++w) {
      const Wall& wall = start.walls[w];
      if (wall.inv_mass() == 0) continue;
      const double free = step.simulation.state().wall_states[w].free_velocity.dot(wall.normal);
      error += std::abs(step.after.walls[w].velocity - exact.walls[w].velocity) / wall.inv_mass();
      change += std::abs(exact.walls[w].velocity - free) / wall.inv_mass();
    }
    return error / change;
  };
  return {error_of_momentum, TruthFrom::any_state, "the solution of the others to 1e-10 was not found"};
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
