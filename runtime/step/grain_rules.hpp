#pragma once

/// What a scene says of grains that come and go; population.hpp does it.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/samples/size_distribution.hpp"
#include "kernels/shapes/region.hpp"

namespace talus {

/// When a rule acts.
struct RuleTimes {
  double from = 0;                                         ///< [s]
  double until = std::numeric_limits<double>::infinity();  ///< [s]
  std::string stage;    ///< in this stage only, from whose beginning the times count; "": of the whole run
  double interval = 0;  ///< [s] between two occasions; 0: every step
};

/// Spheres that come. Without a rate all that are due come at once, when the rule begins.
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
  bool track = false;                    ///< the paths of its grains are told step by step
  int attempts = 200;                    ///< places that are tried for a grain at an occasion, >= 1
  RuleTimes times;
};

/// Grains that go: those whose centre is in the region.
struct RemoveRule {
  std::string name;
  Region region;                     ///< a box, a cylinder or all beyond a plane
  std::optional<Material> material;  ///< of this one only
  std::vector<double> at;            ///< [s] at these times only, ascending; empty: always
  RuleTimes times;
};

}  // namespace talus
