#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/domain.hpp"

namespace talus {

/// Where grains are scattered. Along an axis that repeats, [low, high] is the edge of the cell.
struct ScatterBox {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  ///< [m]
  Domain domain;
  std::uint64_t seed = 1;
  std::uint32_t stream = 0;  ///< of random numbers: one for each sample of a scene
};

/// Spheres that stand there before.
struct StandingGrains {
  std::vector<Vec3> x;         ///< centres [m]
  std::vector<double> radius;  ///< likewise [m]
};

/// Centres [m] in the order of `radii` [m] of spheres that are put at random places one by one, the largest
/// first, where they overlap none of those before, nor of those that `stand` there (random sequential
/// addition); inside the box along axes that do not repeat. Numbers of (seed, stream, grain, try) decide.
/// Equal spheres fill up to about 0.35 of space. Throws std::invalid_argument when some grain finds no room
/// in ten thousand tries.
std::vector<Vec3> scatter(std::span<const double> radii, const ScatterBox& box,
                          const StandingGrains& stand = {});

}  // namespace talus
