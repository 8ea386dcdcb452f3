#include "kernels/global/residuals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/unit/kernels/global/cut_problem.hpp"
#include "tests/unit/kernels/global/held_problem.hpp"

namespace talus {
namespace {

using test::block;
using test::Cut;

Residuals residuals_of_parts(const std::vector<BodyProblem>& parts, const PartLink& link) {
  return residuals_of(test::readers_of(parts), link);
}

Residuals residuals_of_whole(const BodyProblem& problem) {
  return residuals_of_parts({problem}, PartLink{});
}

/// The block with any impulses in the cones.
BodyProblem pushed(int across, int high, double mu, std::uint32_t seed) {
  BodyProblem problem = block(across, high, mu, 20);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> part(0, 1);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k)
    problem.impulse[k] = std::pow(part(random), 6) * 0.1 * problem.contacts[k].normal;
  return problem;
}

// Three grains of mass 1 that fall at 0.01 m/s, the lowest onto a floor that stands still: nothing is carried
// yet, so the floor is asked for one grain's momentum, and that is all there is.
TEST(Residuals, OfAColumnThatFallsAreThoseOfTheFloor) {
  const BodyProblem problem = block(1, 3, 0, 0);
  const Residuals residuals = residuals_of_whole(problem);
  EXPECT_NEAR(residuals.scale, 0.01 / std::sqrt(3.0), 1e-15) << "one of three contacts closes";
  ASSERT_EQ(residuals.contact[0].size(), 3U);
  EXPECT_NEAR(residuals.contact[0][0], std::sqrt(3.0), 1e-12);
  EXPECT_EQ(residuals.contact[0][1], 0);
  EXPECT_EQ(residuals.contact[0][2], 0);
  EXPECT_NEAR(residuals.body[0][0], std::sqrt(3.0), 1e-12);
  EXPECT_EQ(residuals.body[0][2], 0);
}

// A grain that slides at v under the pressure N of its weight is missing mu N of friction, however fast it
// is.
TEST(Residuals, OfAGrainThatSlidesAreThoseOfCoulomb) {
  BodyProblem problem = block(1, 1, 0.25, 0);
  problem.bodies[0].free.u = Vec3(3, 0, -0.01);
  problem.bodies[0].spin_mass = 0;
  problem.impulse[0] = Vec3(0, 0, 0.01);
  const Residuals residuals = residuals_of_whole(problem);
  EXPECT_NEAR(residuals.scale, 3, 1e-12);
  // r - rho (v + mu |v| n) goes along the edge of the polar cone: what is nearest to it lies on the cone's
  // edge.
  EXPECT_NEAR(residuals.contact[0][0] * 3, 0.01 * 0.25 / std::sqrt(1 + 0.25 * 0.25), 1e-12);
  problem.impulse[0] = Vec3(-0.0025, 0, 0.01);
  EXPECT_LT(residuals_of_whole(problem).contact[0][0], 1e-15);
}

TEST(Residuals, AreThoseOfTheWholeHoweverItIsCut) {
  for (const double mu : {0.0, 0.4}) {
    const BodyProblem whole = pushed(3, 8, mu, 5);
    const Residuals expected = residuals_of_whole(whole);
    std::vector<std::int32_t> part_of;
    for (std::size_t k = 0; k < whole.contacts.size(); ++k)
      part_of.push_back(static_cast<std::int32_t>(k % 4));
    const Cut cut(whole, part_of, 4);
    const BodyParts parts(cut.parts, cut);
    const Residuals residuals = residuals_of_parts(cut.parts, cut);
    EXPECT_NEAR(residuals.scale, expected.scale, 1e-12 * expected.scale);
    std::vector<std::size_t> next(4, 0);
    for (std::size_t k = 0; k < whole.contacts.size(); ++k) {
      const auto p = static_cast<std::size_t>(part_of[k]);
      EXPECT_NEAR(residuals.contact[p][next[p]++], expected.contact[0][k], 1e-9);
    }
    for (std::size_t p = 0; p < 4; ++p)
      for (std::size_t b = 0; b < parts[p].bodies.size(); ++b)
        EXPECT_NEAR(residuals.body[p][b], expected.body[0][cut.name(p, b)], 1e-9);
    EXPECT_EQ(quantile_of(residuals, cut, 0.9), quantile_of(expected, PartLink{}, 0.9));
  }
}

// Against the sorted residuals: never below, and at most a class above.
TEST(Residuals, HaveTheQuantilesOfTheirSortedList) {
  for (std::uint32_t seed = 1; seed < 20; ++seed) {
    const Residuals residuals = residuals_of_whole(pushed(4, 9, seed % 2 == 0 ? 0 : 0.3, seed));
    std::vector<double> sorted = residuals.contact[0];
    std::sort(sorted.begin(), sorted.end());
    for (const double part : {0.01, 0.5, 0.9, 0.99, 1.0}) {
      const auto count = static_cast<std::size_t>(std::ceil(part * static_cast<double>(sorted.size())));
      const double exact = sorted[count - 1], found = quantile_of(residuals, PartLink{}, part);
      EXPECT_GE(found, exact);
      EXPECT_LE(found, 1.1 * std::max(exact, 1e-12)) << part;
    }
  }
}

TEST(Residuals, OfNoContactsAreNone) {
  const BodyProblem nothing;
  EXPECT_EQ(quantile_of(residuals_of_whole(nothing), PartLink{}, 0.5), 0);
}

}  // namespace
}  // namespace talus
