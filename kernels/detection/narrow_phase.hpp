#pragma once

#include <limits>
#include <span>

#include "kernels/detection/contacts.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/law/pair_table.hpp"
#include "kernels/shapes/clump.hpp"
#include "kernels/simd/instruction_set.hpp"

namespace talus {

/// Input of the narrow phase. x is at the middle of the step (theta = 1/2), velocities are those of its
/// beginning.
struct NarrowPhase {
  std::span<const Vec3> x;             ///< [m]
  std::span<const double> radius;      ///< [m]
  std::span<const Velocity> velocity;  ///< V-
  std::span<const Wall> walls;         ///< points at the middle of the step
  double time_step;                    ///< h [s]
  double alert;                        ///< [m]
  PairTable laws;
  Vec3 gravity;                                              ///< [m/s^2]
  double turning = std::numeric_limits<double>::infinity();  ///< [m] GapRule::turning
  double reflection = 0;                    ///< E of the step (kernels/law/restitution_law.hpp)
  std::span<const Material> material = {};  ///< of the bodies; empty: material_of_grains
  ClumpView clumps = {};
  Domain domain = {};
  double cell_length = 0;  ///< of Contacts::reach [m]; 0 where no cell follows a stress
};

/// Finds the contacts of one chunk and starts them from the candidates' impulses.
/// A candidate is a contact when gap < alert, or when it would close within a step at its speed. Bias
/// and impacts follow from kernels/law/gap_law.hpp; an approach is fast above 2 h |gravity|.
/// Coincident centres get the normal +z.
///
/// A chunk whose contacts are the same candidates as in the step before keeps their places and groups. If a
/// few contacts came or went the groups are repaired, else dealt anew
/// (kernels/detection/detail/contact_groups.hpp). So groups depend on all steps since allocate(), the first
/// of which deals.
///
/// This processor must run `set`; the choice changes no bit.
void narrow_chunk(const NarrowPhase& in, const Candidates& candidates, const Chunks& chunks,
                  std::size_t chunk, InstructionSet set, Contacts& contacts);

}  // namespace talus
