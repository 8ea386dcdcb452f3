#include "partition/subdomain_colours.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <stdexcept>

namespace talus {
namespace {

/// Boxes of n x n x n that share `face` grains across faces and one across edges.
std::vector<Tie> grid(int n, int face) {
  std::vector<Tie> ties;
  for (int a = 0; a < n * n * n; ++a)
    for (int b = 0; b < n * n * n; ++b) {
      const int dx = std::abs(a % n - b % n), dy = std::abs(a / n % n - b / n % n),
                dz = std::abs(a / (n * n) - b / (n * n));
      if (std::max({dx, dy, dz}) != 1 || dx + dy + dz == 3) continue;
      ties.push_back({SubdomainId(a), SubdomainId(b), dx + dy + dz == 1 ? face : 1});
    }
  return ties;
}

TEST(Turns, OfBoxesAreThoseOfAChessboard) {
  const int n = 4;
  const std::vector<char> subdomain_colour = choose_subdomain_colours(n * n * n, grid(n, 20));
  for (int a = 0; a < n * n * n; ++a)
    EXPECT_EQ(subdomain_colour[static_cast<std::size_t>(a)], (a % n + a / n % n + a / (n * n)) % 2) << a;
}

TEST(Turns, AreThreeWhereTwoLeaveTooManyTiesWithinOne) {
  std::vector<Tie> triangle;
  for (std::int32_t a = 0; a < 3; ++a)
    for (std::int32_t b = 0; b < 3; ++b)
      if (a != b) triangle.push_back({SubdomainId(a), SubdomainId(b), 5});
  const std::vector<char> subdomain_colour = choose_subdomain_colours(3, triangle);
  EXPECT_EQ(std::set<char>(subdomain_colour.begin(), subdomain_colour.end()).size(), 3U);
}

TEST(Turns, DoNotDependOnTheOrderInWhichTiesAreTold) {
  std::vector<Tie> ties = grid(3, 7);
  const std::vector<char> subdomain_colour = choose_subdomain_colours(27, ties);
  std::reverse(ties.begin(), ties.end());
  EXPECT_EQ(choose_subdomain_colours(27, ties), subdomain_colour);
}

TEST(Turns, OfSubdomainsThatShareNothingAreTheFirst) {
  EXPECT_EQ(choose_subdomain_colours(3, {}), std::vector<char>(3, 0));
  EXPECT_EQ(choose_subdomain_colours(1, {}), std::vector<char>(1, 0));
}

TEST(Turns, RefuseATieOfASubdomainThatThereIsNot) {
  const std::vector<Tie> ties = {{SubdomainId(0), SubdomainId(2), 1}};
  EXPECT_THROW(choose_subdomain_colours(2, ties), std::out_of_range);
}

}  // namespace
}  // namespace talus
