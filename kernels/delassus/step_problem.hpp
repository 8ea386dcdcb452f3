#pragma once

#include <span>
#include <vector>

#include "kernels/bodies/motion.hpp"
#include "kernels/delassus/delassus.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/law/pair_table.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus {

/// The contacts of one time step and the bodies they act on, as the sweeps see them; one subdomain.
struct StepView {
  std::span<const Velocity> bodies;  ///< per slot; only the mobilities 1/m and R^2/I are read
  const FreeVelocity& free;          ///< per slot; w empty: nothing turns
  const Contacts& contacts;          ///< with the impulses that the step has found
  const Chunks& chunks;              ///< which of the contacts' rooms are filled, and which are at walls
  std::span<const Wall> walls;       ///< mass and normal of pushed walls
  std::span<const Vec3> wall_free;   ///< per wall: velocity without contacts [m/s]
  const PairTable& laws;
};

struct StepProblem {
  DelassusProblem problem;
  std::vector<double> r;  ///< 3 per contact: the step's impulses as the law sees them, normal first [N s]
};

/// W = H' M^-1 H, q = H' V_free + b n and mu of a step that the simulation itself solves without ever
/// building W. Contacts in the order of the chunks; frame (n, t, s) with any t orthogonal to n. Contacts are
/// coupled when they share a grain or a pushed wall, so that such a wall makes a full block of W: some 9 w^2
/// entries for w contacts at it.
StepProblem assemble_step(const StepView& step);

}  // namespace talus
