#pragma once

/// Small scenes for the closed forms: one stage, one thread, a tight tolerance.

#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/executor.hpp"
#include "runtime/step/simulation.hpp"

namespace talus::validation {

constexpr double g_earth = 9.81;  // [m/s^2]
constexpr double pi = 3.14159265358979324;
constexpr double epsilon = std::numeric_limits<double>::epsilon();

using ShapeNumbers = std::map<std::string, std::vector<double>>;

/// A scene under construction: one stage, solved nearly exactly.
struct Scene {
  Setup setup;
  Bodies bodies;

  explicit Scene(double time_step) {
    Stage stage;
    stage.name = "all";
    stage.time_step = time_step;
    stage.end.steps = std::numeric_limits<std::int64_t>::max();
    setup.stages.push_back(std::move(stage));
    setup.solver.tolerance = 1e-12;
    setup.solver.balance_tolerance = 1e-10;
    setup.solver.max_iterations = 100000;
    setup.solver.check_every = 2;
  }
  Stage& stage() { return setup.stages.front(); }
  void friction(double mu) { stage().laws.set_all(&PairLaw::friction, mu); }

  Wall& wall(std::string name, const Vec3& point, const Vec3& normal) {
    Wall wall;
    wall.name = std::move(name);
    wall.point = point;
    wall.normal = normal.normalized();
    return setup.walls.emplace_back(std::move(wall));
  }
  /// A wall that is no plane, named as its shape.
  void surface(const std::string& shape, ShapeNumbers numbers, std::vector<Triangle> triangles = {}) {
    Wall wall;
    wall.name = shape;
    wall.normal.setZero();
    wall.shape = {shape, {std::move(numbers), "", std::move(triangles)}, nullptr};
    make_surface(wall.shape);
    setup.walls.push_back(std::move(wall));
  }
  /// Floor z = 0 under gravity turned by `angle` about y: a slope that descends along +x.
  void slope(double angle) {
    wall("floor", Vec3::Zero(), Vec3::UnitZ());
    stage().gravity = g_earth * Vec3(std::sin(angle), 0, -std::cos(angle));
  }
  /// A sphere of the given mass; its id is its place in order of addition.
  Velocity& sphere(const Vec3& centre, double radius, double mass, const Vec3& u = Vec3::Zero()) {
    const double density = mass / (4.0 / 3.0 * pi * radius * radius * radius);
    add_sphere(bodies, BodyId{static_cast<std::int64_t>(bodies.size())}, centre, radius, density);
    Velocity& velocity = bodies.velocity.back();
    for (int axis = 0; axis < 3; ++axis) velocity.u[axis] = u[axis];
    return velocity;
  }
};

/// A scene at work.
class Experiment {
 public:
  explicit Experiment(Scene scene, int threads = 1)
      : executor_({.threads = threads}),
        simulation_(std::move(scene.setup), std::move(scene.bodies), executor_) {}

  const StepReport& step() { return simulation_.step(); }
  void steps(std::int64_t count) {
    for (std::int64_t k = 0; k < count; ++k) simulation_.step();
  }
  /// Goes on to the next stage, if this one has ended.
  bool next_stage() { return simulation_.begin_next_stage(); }
  const Simulation& simulation() const { return simulation_; }
  double time() const { return simulation_.report().time; }

  std::size_t slot(std::int64_t id) const {
    const auto& ids = simulation_.state().bodies.id;
    std::size_t s = 0;
    while (ids[s] != BodyId{id}) ++s;
    return s;
  }
  Vec3 x(std::int64_t id = 0) const { return simulation_.state().bodies.x[slot(id)]; }
  Vec3 u(std::int64_t id = 0) const {
    return Eigen::Map<const Vec3>(simulation_.state().bodies.velocity[slot(id)].u);
  }
  /// R omega [m/s].
  Vec3 w(std::int64_t id = 0) const {
    return Eigen::Map<const Vec3>(simulation_.state().bodies.velocity[slot(id)].w);
  }
  /// Force of a wall on the grains, mean over the last step [N].
  Vec3 wall_force(std::size_t wall) const { return simulation_.walls()[wall].force; }

  double kinetic_energy() const {
    const KineticEnergy energy = talus::kinetic_energy(simulation_.state().bodies.velocity);
    return energy.translation + energy.rotation;
  }
  double mechanical_energy() const {
    const Bodies& bodies = simulation_.state().bodies;
    double energy = kinetic_energy();
    for (std::size_t s = 0; s < bodies.size(); ++s)
      energy -= bodies.mass(s) * simulation_.stage().gravity.dot(bodies.x[s]);
    return energy;
  }

 private:
  graph::Executor executor_;
  Simulation simulation_;
};

}  // namespace talus::validation
