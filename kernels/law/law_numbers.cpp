#include "kernels/law/law_numbers.hpp"

#include <limits>
#include <vector>

#include "kernels/bodies/farthest.hpp"

namespace talus {

std::span<const LawNumberEntry> law_numbers() {
  static const std::vector<LawNumberEntry> entries = [] {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    std::vector<LawNumberEntry> all = {
        {&PairLaw::friction, "friction", "", farthest, "Coulomb friction."},
        {&PairLaw::restitution, "restitution", "", 1, "Newton restitution of the normal velocity."}};
    for (const Attraction* one : attractions)
      all.push_back({*one, one->name, one->unit, infinity, one->sentence});
    all.push_back({&PairLaw::rolling_resistance, "rolling_resistance", "", farthest,
                   "Moment that resists rolling, over the normal force times the reduced radius; needs "
                   "friction; clumps have none."});
    return all;
  }();
  return entries;
}

}  // namespace talus
