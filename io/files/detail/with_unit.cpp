#include "io/files/detail/with_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace talus::io::detail {

std::string with_unit(double value, std::string_view unit) {
  static constexpr std::string_view prefixes[] = {"f", "p", "n", "µ", "m", "", "k", "M", "G", "T"};
  if (value == 0 || !std::isfinite(value)) return fmt::format("{} {}", value, unit);
  // Rounded first, so that 0.99996 m is 1 m and not 1e+03 mm.
  const double rounded = std::stod(fmt::format("{:.2e}", value));
  const int thousands =
      std::clamp(static_cast<int>(std::floor(std::log10(std::abs(rounded)) / 3 + 1e-9)), -5, 4);
  return fmt::format("{:.3g} {}{}", rounded / std::pow(1000.0, thousands), prefixes[thousands + 5], unit);
}

}  // namespace talus::io::detail
