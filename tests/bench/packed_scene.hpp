#pragma once

/// A packing between walls: what the benchmarks of solvers solve.

#include <string>

#include "runtime/step/setup.hpp"
#include "tests/bench/packing.hpp"

namespace talus::bench {

/// One step, begun cold. Triaxial: three sides pressed with the weight of the sample, mu between grains.
/// Pile: gravity, no lid, mu at the walls too. Grains of density 1 in a box [0, edge]^3; the answer scales
/// with it.
inline Setup packed_scene(const Packing& packing, bool pile, double tolerance, double mu = 0.35) {
  Setup setup;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      Wall wall;
      wall.name = std::string(1, "xyz"[axis]) + (side > 0 ? "-" : "+");
      wall.normal = side * Vec3::Unit(axis);
      wall.point = Vec3::Unit(axis) * (side > 0 ? 0 : packing.edge);
      if (pile && wall.name == "z+") continue;
      setup.walls.push_back(wall);
    }
  double mass = 0;
  for (std::size_t k = 0; k < packing.bodies.size(); ++k) mass += packing.bodies.mass(k);
  Stage stage;
  stage.name = pile ? "pile" : "triaxial";
  stage.time_step = 1e-3;
  stage.laws = laws_of_one_material(mu, pile ? mu : 0.0, 0);
  stage.end.steps = 1;
  if (pile) stage.gravity = Vec3(0, 0, -9.81);
  WallLoad load;
  load.drive = WallDrive::pressure;
  load.pressure = 9.81 * mass / (packing.edge * packing.edge);  // the weight of the sample on each face
  load.mass = 0.1 * mass;
  if (!pile)
    for (const char* name : {"x+", "y+", "z+"}) stage.loads.push_back({name, load});
  setup.stages = {stage};
  setup.solver.tolerance = tolerance;
  return setup;
}

}  // namespace talus::bench
