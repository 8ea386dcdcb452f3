#include "runtime/step/stage_loads.hpp"

#include <cstddef>

namespace talus {

void take_loads(const Stage& stage, std::span<Wall> walls) {
  for (const auto& [name, load] : stage.loads)
    for (Wall& wall : walls)
      if (wall.name == name) wall.load = load;
}

void put_load(Wall& wall, const std::vector<Wall>& walls) {
  if (wall.load.drive == WallDrive::fixed) wall.velocity.setZero();
  if (wall.load.drive == WallDrive::velocity) wall.velocity = wall.load.velocity;
  if (wall.load.pushed()) {
    wall.velocity = wall.velocity.dot(wall.normal) * wall.normal;
    if (wall.load.velocity != Vec3::Zero()) wall.velocity += wall.load.velocity;
  }
  if (wall.load.drive == WallDrive::pressure)
    face_area(walls, static_cast<std::size_t>(&wall - walls.data()));
}

StepParameters parameters_of(const Setup& setup, const Stage& stage, StepParameters now) {
  now.gravity = stage.gravity;
  now.laws = stage.laws;
  now.reflection = reflection_of(setup.solver.restitution_law, now.laws);
  now.clumps = !setup.clumps.empty();
  now.friction = now.clumps || stage.laws.largest(&PairLaw::friction) > 0;
  now.rotates = now.friction && setup.rotation;
  now.rolls = now.rotates && stage.laws.largest(&PairLaw::rolling_resistance) > 0;
  return now;
}

}  // namespace talus
