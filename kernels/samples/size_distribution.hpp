#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace talus {

/// Distribution of grain radii. Fields that the kind does not use keep their defaults.
struct SizeDistribution {
  enum class Kind {
    constant,        ///< all `max`
    uniform,         ///< every radius in [min, max] is as likely
    uniform_volume,  ///< each class of radii in [min, max] holds the same volume of grains: density of radii
                     ///< ~ r^-3 (Voivret et al. 2007, uniform by volume fraction)
    normal,          ///< mean and deviation, cut at min and max
    lognormal,       ///< ln r is normal: about ln(mean), with `deviation`; cut at min and max
    sieve,           ///< sieves of openings `sizes`, through which `parts` per cent of the mass pass; between
                     ///< two sieves each class of radii holds the same volume
    fractions,       ///< radii `sizes` and nothing between, of masses in the ratio of `parts`
  };
  Kind kind = Kind::constant;
  double min = 0;               ///< [m]
  double max = 0;               ///< [m]
  double mean = 0;              ///< [m] normal: mean; lognormal: median
  double deviation = 0;         ///< normal: standard deviation [m]; lognormal: that of ln r
  std::vector<double> sizes{};  ///< [m] sieve: diameters, ascending; fractions: radii
  std::vector<double>
      parts{};  ///< sieve: per cent of the mass that is finer, from 0 to 100; fractions: masses
};

/// "" or what makes no sense, as a sentence without its end.
std::string fault_of(const SizeDistribution& sizes);

/// Bounds of the radii [m].
double smallest_radius(const SizeDistribution& sizes);
double largest_radius(const SizeDistribution& sizes);

/// Grain k of a sample or an insertion, of which each has a `stream` of its own, below 2^16.
struct GrainNumber {
  std::uint64_t seed = 1;
  std::uint32_t stream = 0;
  std::uint64_t k = 0;
};

/// Draws radii, each from its number alone, so that they are the same in any order, on any machine: random
/// numbers are counters, and logarithms and exponentials are computed by arithmetic that IEEE fixes.
class RadiusSource {
 public:
  /// Throws std::invalid_argument when fault_of finds any.
  explicit RadiusSource(SizeDistribution sizes);
  double of(const GrainNumber& grain) const;  ///< [m]

 private:
  double drawn(const GrainNumber& grain) const;
  double by_class(double number) const;

  SizeDistribution sizes_;
  std::vector<double> share_;  ///< sieve, fractions: part of the grains, by number, up to and with a class
};

/// n radii [m]; radius k depends on the distribution, `seed`, `stream` and k only.
/// Throws std::invalid_argument when fault_of finds any.
std::vector<double> draw_radii(const SizeDistribution& sizes, std::size_t n, std::uint64_t seed,
                               std::uint32_t stream = 0);

}  // namespace talus
