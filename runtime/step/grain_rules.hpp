#pragma once

/// Rules of a scene that insert and remove grains; population.hpp carries them out.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/samples/size_distribution.hpp"
#include "kernels/shapes/region.hpp"

namespace talus {

/// Part by which what is inserted may exceed `count`, `mass` or a rate, as rounding of these takes no grain
/// away.
inline constexpr double amount_rounding = 1e-9;

/// When a rule acts.
struct RuleTimes {
  double from = 0;                                         ///< [s]
  double until = std::numeric_limits<double>::infinity();  ///< [s]
  std::string stage;    ///< in this stage only, times counted from its beginning; "": in the whole run
  double interval = 0;  ///< [s] between two occasions; 0: every step
};

/// Spheres to insert. Without a rate all of them are due when the rule begins.
struct InsertRule {
  std::string name;
  Region region;  ///< a box, a cylinder or a disc
  SizeDistribution radii;
  Material material = material_of_grains;
  double density = 0;                    ///< [kg/m^3]
  Vec3 velocity = Vec3::Zero();          ///< [m/s]
  Vec3 angular_velocity = Vec3::Zero();  ///< [rad/s]
  std::optional<std::int64_t> count;     ///< no more than so many in all
  std::optional<double> mass;            ///< no more than so much in all [kg]
  std::optional<double> rate;            ///< grains a second
  std::optional<double> mass_rate;       ///< [kg/s]
  bool track = false;                    ///< the paths of its grains are reported step by step
  int attempts = 200;                    ///< places that are tried for a grain at an occasion, >= 1
  RuleTimes times;
};

/// Removes grains: those whose centre is in the region.
struct RemoveRule {
  std::string name;
  Region region;                     ///< a box, a cylinder or all beyond a plane
  std::optional<Material> material;  ///< of this material only
  std::vector<double> at;            ///< [s] at these times only, ascending; empty: always
  RuleTimes times;
};

}  // namespace talus
