#pragma once

namespace talus::io {

/// What a scene loads its grains with; 0 where it does not.
struct GrainLoad {
  double pressure = 0;  ///< [Pa] the largest on a wall, in any stage
  double weight = 0;    ///< [N/m^3] density of the heaviest grains times gravity
};

}  // namespace talus::io
