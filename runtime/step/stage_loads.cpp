#include "runtime/step/stage_loads.hpp"

#include <cstddef>

#include "runtime/step/runaway.hpp"

namespace talus {

void take_loads(const Stage& stage, std::span<Wall> walls) {
  for (const auto& [name, load] : stage.loads)
    for (Wall& wall : walls)
      if (wall.name == name) wall.load = load;
}

void put_load(Wall& wall, const std::vector<Wall>& walls, const Domain& domain) {
  if (wall.load.drive == WallDrive::fixed) wall.velocity.setZero();
  if (wall.load.drive == WallDrive::velocity) wall.velocity = wall.load.velocity;
  if (wall.load.pushed()) {
    wall.velocity = wall.velocity.dot(wall.normal) * wall.normal;
    if (wall.load.velocity != Vec3::Zero()) wall.velocity += wall.load.velocity;
  }
  if (!wall.absent && wall.load.drive == WallDrive::pressure)
    face_area(walls, static_cast<std::size_t>(&wall - walls.data()), domain.edges());
}

namespace {

/// Force that wall w is pushed with, along its normal [N].
double push_on(const StepState& state, std::size_t w, const Vec3& gravity, const StepName& step) {
  const Wall& wall = state.walls[w];
  if (wall.absent || !wall.load.pushed()) return 0;
  const double push = wall.load.drive == WallDrive::pressure
                          ? wall.load.pressure * pressed_area(state, w, step)
                          : wall.load.force;
  return wall.load.weight ? push + wall.load.mass * gravity.dot(wall.normal) : push;
}

}  // namespace

void apply_loads(const StepParameters& parameters, const StepName& step, StepState& state) {
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    Wall& wall = state.walls[w];
    WallState& wall_state = state.wall_states[w];
    wall_state.applied = push_on(state, w, parameters.gravity, step);
    if (wall.absent && wall.load.pushed()) wall.velocity.setZero();
    wall.gain = parameters.time_step * wall_state.applied * wall.inv_mass() * wall.normal;
    wall_state.free_velocity = wall.velocity + wall.gain / (1 + parameters.reflection);
  }
}

StepParameters parameters_of(const Setup& setup, const Stage& stage, StepParameters now) {
  now.gravity = stage.gravity;
  now.velocity_gradient = Mat3(stage.strain_rates.asDiagonal());
  now.velocity_gradient(0, 1) = stage.shear_rates[0];
  now.velocity_gradient(0, 2) = stage.shear_rates[1];
  now.velocity_gradient(1, 2) = stage.shear_rates[2];
  now.laws = stage.laws;
  now.reflection = reflection_of(setup.solver.restitution_law, now.laws);
  now.clumps = !setup.clumps.empty();
  now.friction = now.clumps || stage.laws.largest(&PairLaw::friction) > 0;
  now.rotates = now.friction && setup.rotation;
  now.rolls = now.rotates && stage.laws.largest(&PairLaw::rolling_resistance) > 0;
  return now;
}

}  // namespace talus
