#pragma once

#include <span>

#include "kernels/detection/contacts.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/law/pair_table.hpp"
#include "kernels/shapes/clump.hpp"
#include "kernels/simd/instruction_set.hpp"

namespace talus {

/// What the narrow phase looks at; x at the middle of the step (theta = 1/2), velocities those of its
/// beginning.
struct NarrowPhase {
  std::span<const Vec3> x;             ///< [m]
  std::span<const double> radius;      ///< [m]
  std::span<const Velocity> velocity;  ///< V-
  std::span<const Wall> walls;         ///< points at the middle of the step
  double time_step;                    ///< h [s]
  double alert;                        ///< [m]
  PairTable laws;
  Vec3 gravity;                             ///< [m/s^2]
  double reflection = 0;                    ///< E of the step (kernels/law/restitution_law.hpp)
  std::span<const Material> material = {};  ///< of the bodies; empty: material_of_grains
  ClumpView clumps = {};
  [[no_unique_address]] Domain domain = {};
};

/// Finds the contacts of one chunk and starts them from the candidates' impulses.
/// A candidate is a contact when gap < alert, or when it would close within a step at its speed. Bias
/// (docs/theory.md, "Gap term and restitution"): inelastic quasi-Signorini b = max(g, 0)/h; with e > 0 and an
/// approach faster than 2 h |gravity|, Moreau's impact law: b = e v_n- once g <= 0, and no constraint before.
/// Coincident centres get the normal +z.
///
/// A chunk whose contacts are the candidates that they were keeps their places and groups; where a few came
/// or went these are repaired, else dealt anew (kernels/detection/detail/contact_groups.hpp). So groups
/// follow from the steps since allocate(), the first of which deals.
///
/// `set` runs on this processor; which one it is changes no bit.
void narrow_chunk(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                  std::size_t chunk, InstructionSet set, Contacts& contacts);

}  // namespace talus
