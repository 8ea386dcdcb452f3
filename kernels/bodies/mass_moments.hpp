#pragma once

#include <cstdint>

#include "kernels/bodies/types.hpp"

namespace talus {

/// Mass, mean velocity and spread of velocities of some bodies. Sums are taken about the mean that is known
/// so far, so that nothing cancels where all move fast and alike; add in a fixed order only.
struct MassMoments {
  std::int64_t count = 0;
  double mass = 0;             ///< [kg]
  Vec3 mean = Vec3::Zero();    ///< velocity of the centre of mass [m/s]
  Mat3 spread = Mat3::Zero();  ///< sum of m (u - mean) (x) (u - mean) [J]

  void add(double m, const Vec3& u) { add({1, m, u, Mat3::Zero()}); }
  void add(const MassMoments& other) {
    count += other.count;
    if (other.mass == 0) return;
    const double both = mass + other.mass;
    const Vec3 apart = other.mean - mean;
    spread += other.spread + mass * (other.mass / both) * apart * apart.transpose();
    mean += other.mass / both * apart;
    mass = both;
  }
  /// A third of the mean square of u - mean, weighed by mass [m^2/s^2]; 0 of no mass.
  double temperature() const { return mass > 0 ? spread.trace() / (3 * mass) : 0; }
};

}  // namespace talus
