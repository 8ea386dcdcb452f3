#pragma once
namespace talus {
/// Distribution of grain radii [m]. constant: all `max`; uniform: uniform in [min, max]; uniform_volume: each
/// radius class holds the same volume of grains, density of radii ~ r^-3 in [min, max] (Voivret et al. 2007,
/// uniform by volume fraction).
struct SizeDistribution {
  enum class Kind { constant, uniform, uniform_volume };
  Kind kind = Kind::constant;
  double min = 0;
  double max = 0;
};
}  // namespace talus
