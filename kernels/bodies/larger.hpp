#pragma once

#include <cmath>

namespace talus {

/// The larger one; NaN if either is, which std::max would hide.
inline double larger(double a, double b) {
  return a <= b || std::isnan(b) ? b : a;
}

}  // namespace talus
