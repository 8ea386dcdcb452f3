#pragma once

/// Contents of the regions of the probes, after a step.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/mass_moments.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/probe_rules.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Sums over the bodies whose centre is in a region, and over what else of bodies and contacts lies in it.
struct RegionSums {
  MassMoments motion;                ///< of the bodies
  double volume = 0;                 ///< of solid in the region: parts of spheres, whole clumps [m^3]
  std::int64_t ends = 0;             ///< ends of active contacts, at these bodies
  Mat3 moment = Mat3::Zero();        ///< sum of r (x) l, as far as the branch l lies in the region [N s m]
  std::vector<std::int64_t> counts;  ///< of the bodies, by material
  std::vector<double> masses;        ///< likewise [kg]
};

/// Sums over each of `regions`, with the poses and velocities of the end of the step. Subdomain after
/// subdomain, in the order of their slots and contacts: the same bits on any ranks and threads. Collective;
/// all ranks get all sums.
std::vector<RegionSums> sum_over_regions(std::span<const Region> regions, std::size_t materials,
                                         const StepState& state, const graph::Communicator& ranks);

}  // namespace talus
