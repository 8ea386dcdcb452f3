#pragma once

#include <cstdint>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "partition/partitioner.hpp"

namespace talus {

/// Subdomains whose region comes within `distance` [m] of `point`, ascending, each once; measured along the
/// axes, so that some that are a little farther may be among them. distance >= 0, point finite.
std::vector<SubdomainId> subdomains_within(const Partition& partition, const Vec3& point, double distance);

}  // namespace talus
