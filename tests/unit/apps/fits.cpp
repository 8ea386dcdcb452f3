#include "apps/validate/fits.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace talus::literature {
namespace {

// Two points at 1 and 2 give the line 2 y_1 - y_2 at 0.
TEST(Fits, TheStartOfALineIsAsUncertainAsItsPointsAndTheWayToThem) {
  const std::array<double, 2> x{1, 2}, y{5, 4}, errors{0.3, 0.4};
  EXPECT_NEAR(fit_line(x, y).start, 6, 1e-12);
  EXPECT_NEAR(error_of_start(x, errors), std::sqrt(4 * 0.09 + 0.16), 1e-12);
}

// Over a power of x, too: with y = 2 + 3 x^(1/2).
TEST(Fits, ALineOverAPowerIsFoundAgain) {
  const auto root = [](double at) { return std::sqrt(at); };
  const std::array<double, 3> x{0.01, 0.25, 1}, y{2.3, 3.5, 5}, errors{0.1, 0.1, 0.1};
  EXPECT_NEAR(fit_line(x, y, root).start, 2, 1e-12);
  EXPECT_NEAR(fit_line(x, y, root).slope, 3, 1e-12);
  EXPECT_GT(error_of_start(x, errors, root), 0.1 / std::sqrt(3.0));
}

}  // namespace
}  // namespace talus::literature
