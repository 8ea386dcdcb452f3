#include "kernels/samples/size_distribution.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kernels/samples/detail/random_numbers.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::size_distribution_test {
namespace {

using Kind = SizeDistribution::Kind;
constexpr std::size_t many = 200000;

double cube(double r) {
  return r * r * r;
}

/// Part of the mass in grains of less than this radius.
double mass_below(const std::vector<double>& radii, double radius) {
  double below = 0, all = 0;
  for (const double r : radii) {
    all += cube(r);
    if (r < radius) below += cube(r);
  }
  return below / all;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double deviation_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

/// IEEE arithmetic alone gives their bits; they must be logarithm and exponential all the same.
TEST(PortableFunctions, AgreeWithTheLibraryToRounding) {
  for (std::uint64_t k = 0; k < 5000; ++k) {
    const auto [a, b] = detail::uniform_pair(3, k, 0);
    const double x = a * std::exp2(60 * (b - 0.5));
    EXPECT_NEAR(detail::portable_log(x), std::log(x), 4e-16 * std::max(1.0, std::abs(std::log(x)))) << x;
    const double y = 40 * (a - 0.5);
    EXPECT_NEAR(detail::portable_exp(y) / std::exp(y), 1, 4e-15) << y;
  }
}

TEST(SizeDistributions, NormalHasItsMeanAndDeviationAndIsCut) {
  SizeDistribution sizes{Kind::normal, 0.5, 1.5};
  sizes.mean = 1;
  sizes.deviation = 0.1;
  const std::vector<double> radii = draw_radii(sizes, many, 5);
  EXPECT_NEAR(mean_of(radii), 1, 4 * 0.1 / std::sqrt(many));
  EXPECT_NEAR(deviation_of(radii), 0.1, 4 * 0.1 / std::sqrt(2.0 * many));
  sizes.min = 0.95;
  sizes.max = 1.1;
  const auto [least, most] = std::ranges::minmax(draw_radii(sizes, 5000, 5));
  EXPECT_GE(least, 0.95);
  EXPECT_LE(most, 1.1);
}

TEST(SizeDistributions, LogarithmsOfALognormalOneAreNormal) {
  SizeDistribution sizes{Kind::lognormal, 0.01, 100};
  sizes.mean = 2;
  sizes.deviation = 0.3;
  std::vector<double> logarithms = draw_radii(sizes, many, 5);
  for (double& value : logarithms) value = std::log(value);
  EXPECT_NEAR(mean_of(logarithms), std::log(2), 4 * 0.3 / std::sqrt(many));
  EXPECT_NEAR(deviation_of(logarithms), 0.3, 4 * 0.3 / std::sqrt(2.0 * many));
}

TEST(SizeDistributions, SievesHoldTheMassesOfTheTable) {
  SizeDistribution sizes{Kind::sieve};
  sizes.sizes = {1e-3, 2e-3, 4e-3, 8e-3};  // diameters
  sizes.parts = {0, 20, 50, 100};
  const std::vector<double> radii = draw_radii(sizes, many, 5);
  EXPECT_EQ(smallest_radius(sizes), 0.5e-3);
  EXPECT_EQ(largest_radius(sizes), 4e-3);
  EXPECT_GE(std::ranges::min(radii), 0.5e-3);
  EXPECT_LE(std::ranges::max(radii), 4e-3);
  EXPECT_NEAR(mass_below(radii, 1e-3), 0.2, 0.02);
  EXPECT_NEAR(mass_below(radii, 2e-3), 0.5, 0.02);
  // Between two sieves: half of the class's mass below the middle.
  EXPECT_NEAR(mass_below(radii, 3e-3), 0.75, 0.02);
}

TEST(SizeDistributions, FractionsHaveTheirRadiiAndMasses) {
  SizeDistribution sizes{Kind::fractions};
  sizes.sizes = {2e-3, 1e-3};
  sizes.parts = {3, 1};
  const std::vector<double> radii = draw_radii(sizes, many, 5);
  for (const double r : radii) EXPECT_TRUE(r == 1e-3 || r == 2e-3);
  EXPECT_NEAR(mass_below(radii, 1.5e-3), 0.25, 0.01);
}

TEST(SizeDistributions, StreamsAreIndependentAndTheFirstIsThatOfOldScenes) {
  SizeDistribution sizes{Kind::uniform, 1, 2};
  EXPECT_EQ(draw_radii(sizes, 10, 5), draw_radii(sizes, 10, 5, 0));
  EXPECT_NE(draw_radii(sizes, 10, 5), draw_radii(sizes, 10, 5, 1));
}

TEST(SizeDistributions, SayWhatMakesNoSense) {
  SizeDistribution sieve{Kind::sieve};
  sieve.sizes = {1e-3, 2e-3};
  sieve.parts = {0, 90};
  EXPECT_NE(fault_of(sieve).find("100 per cent"), std::string::npos);
  sieve.parts = {0, 100, 100};
  EXPECT_NE(fault_of(sieve).find("same length"), std::string::npos);
  SizeDistribution bell{Kind::normal, 2, 3};
  bell.mean = 1;
  bell.deviation = 0.1;
  EXPECT_NE(fault_of(bell).find("leave out"), std::string::npos);
  EXPECT_THROW(draw_radii(bell, 1, 1), std::invalid_argument);
}

TEST(LatticesInRegions, FillACylinderWithoutOverlapAndLeaveNoSiteOut) {
  Region region;
  region.kind = Region::Kind::cylinder;
  region.end = {0, 0, 1};
  region.radius = 0.5;
  const std::vector<Vec3> sites = lattice_in(region, 0.05, 0.105, 100000);
  for (std::size_t k = 0; k < sites.size(); ++k) {
    EXPECT_TRUE(holds(region, sites[k], 0.0499));
    for (std::size_t j = 0; j < k; ++j) ASSERT_GT((sites[k] - sites[j]).norm(), 0.1049);
  }
  // 9 layers, and nearly as many sites a layer as its area holds.
  EXPECT_EQ(sites.size() % 9, 0u);
  EXPECT_NEAR(static_cast<double>(sites.size() / 9) * 0.105 * 0.105, M_PI * 0.45 * 0.45, 0.12);
  EXPECT_EQ(lattice_in(region, 0.05, 0.105, 7).size(), 7u);
}

}  // namespace
}  // namespace talus::size_distribution_test
