#pragma once

/// Laws by which bodies that touch hold one another: each is a force along the normal, c >= 0 [N], by which
/// Signorini's condition and Coulomb's cone are shifted (kernels/sweeps/cohesion.hpp). Those of a pair add up
/// (PairLaw::cohesion_of). One file in attractions/ for each.

#include <array>
#include <cmath>

namespace talus {

/// Two spheres that touch, or a sphere and a wall, whose radius is infinite.
struct TouchingRadii {
  double first, second;  ///< [m]
  /// l with 1/l = 1/R_1 + 1/R_2 [m].
  double reduced() const { return std::isinf(second) ? first : first * second / (first + second); }
};

struct CohesionRule {
  /// Bodies touch where the gap is at most this part of the smaller radius. Rounding and the tolerance of a
  /// step open the contacts of a chain under tension by a small part of it, and cohesion closes them again.
  double reach = 1e-3;
};

struct Attraction {
  const char* name;      ///< key of [material] and [[pair]]
  const char* unit;      ///< of its number, which is >= 0 and 0 where the law does not hold
  const char* sentence;  ///< for the reference of scene files
  double (*force)(double number, const TouchingRadii& radii);  ///< c [N] >= 0
};

extern const Attraction cohesion_attraction;
extern const Attraction adhesion_attraction;

inline constexpr std::array attractions = {&cohesion_attraction, &adhesion_attraction};

}  // namespace talus
