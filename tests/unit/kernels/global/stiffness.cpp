// How many sweeps a problem is said to need.

#include "kernels/global/stiffness.hpp"

#include <gtest/gtest.h>

namespace talus::stiffness_test {
namespace {

TEST(StiffnessOfACell, GrowsWithItsAreaAndWithItsHeaviestGrain) {
  EXPECT_EQ(stiffness_of_cell(10, 8), 100) << "what diffuses over 10 layers takes 10^2 sweeps";
  EXPECT_EQ(stiffness_of_cell(20, 8), 4 * stiffness_of_cell(10, 8));
  // T grain masses over L layers of c contacts take T L/c, as under a plate: more than the layers alone ask.
  EXPECT_EQ(stiffness_of_cell(10, 6000), 10 * 6000 / 6.0);
  EXPECT_EQ(stiffness_of_cell(10, 6000, {.contacts = 12}), 10 * 6000 / 12.0);
}

}  // namespace
}  // namespace talus::stiffness_test
