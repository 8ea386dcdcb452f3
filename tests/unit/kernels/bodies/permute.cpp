#include "kernels/bodies/permute.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace talus {
namespace {

TEST(Permutation, InPlaceIsTheOneBesideIt) {
  // None, one, all in place, one cycle over all, and cycles of one, two and three entries.
  const std::vector<std::vector<Slot>> orders = {
      {}, {0}, {0, 1, 2}, {1, 2, 3, 4, 0}, {4, 1, 5, 2, 0, 3}, {5, 4, 3, 2, 1, 0}};
  for (const std::vector<Slot>& order : orders) {
    std::vector<double> beside;
    for (std::size_t k = 0; k < order.size(); ++k) beside.push_back(0.5 + static_cast<double>(k));
    std::vector<double> in_place = beside;
    permute(beside, order);
    permute_in_place(in_place, order);
    EXPECT_EQ(in_place, beside) << "permutation of " << order.size();
  }
}

TEST(Permutation, InPlaceLeavesAnEmptyArrayEmpty) {
  std::vector<double> none;
  permute_in_place(none, std::vector<Slot>{1, 0});
  EXPECT_TRUE(none.empty());
}

}  // namespace
}  // namespace talus
