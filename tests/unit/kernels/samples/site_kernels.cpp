#include "kernels/samples/detail/site_kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>

#include "kernels/samples/resting_site.hpp"
#include "kernels/simd/instruction_set.hpp"

namespace talus {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Grains, a wall and perhaps the floor around a grain, as a deposition hands them to the kernels.
struct Around {
  SiteRule rule{};
  std::vector<Obstacle> obstacles;
  std::array<std::vector<double>, 7> components;
  std::size_t floor = 0;

  explicit Around(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto real = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const double ratio = std::array{1.0, 2.0, 10.0}[seed % 3];
    rule = {real(1, ratio), 1, ratio, 1e-12, 0.5e-12 * ratio * ratio};
    const int grains = static_cast<int>(real(2, 30));
    while (static_cast<int>(obstacles.size()) < grains) {
      const double r = real(1, ratio);
      const Vec3 x{real(-4, 4) * ratio, real(-4, 4) * ratio, real(-4, 2) * ratio};
      if (const double gap = x.norm() - r - rule.base_radius; gap < 0 || gap > 2 * ratio) continue;
      add(grain_obstacle(x, r, rule.base_radius), r);
    }
    if (seed % 2 == 0) add(wall_obstacle(Vec3::UnitX(), real(1, 2) * ratio), infinity);
    floor = obstacles.size();
    if (seed % 5 == 0) add(wall_obstacle(Vec3::UnitZ(), real(1, 2) * ratio), infinity);
    count = obstacles.size();
    for (std::size_t k = 0; k < obstacle_padding; ++k) add({Vec3::Zero(), infinity, 0, false}, 0);
    obstacles.resize(count);
  }

  ObstacleView view() const {
    const auto of = [&](std::size_t c) { return components[c].data(); };
    return {of(0), of(1), of(2), of(3), of(4), of(5), of(6), count, floor};
  }

  /// The exact answer: whether a grain of some radius can rest on the grain and these two.
  bool carries(std::size_t i, std::size_t j) const {
    SiteCurve curve;
    if (!site_curve(rule.base_radius, obstacles[i], obstacles[j], 1, curve)) return false;
    RadiusRanges ranges{{rule.smallest, rule.largest}};
    keep_real(curve, ranges);
    if (!ranges.empty()) keep_stable(curve, obstacles[i], obstacles[j], rule.stable_slack, ranges);
    for (std::size_t n = 0; n < count && !ranges.empty(); ++n)
      if (n != i && n != j) keep_clear(curve, obstacles[n], rule.clear_slack, ranges);
    return !ranges.empty();
  }

  std::size_t count = 0;

 private:
  void add(const Obstacle& o, double radius) {
    obstacles.push_back(o);
    const std::array<double, 7> values{o.d[0], o.d[1], o.d[2], o.e0, o.e1, o.round ? 1.0 : 0.0, radius};
    for (std::size_t c = 0; c < values.size(); ++c) components[c].push_back(values[c]);
  }
};

std::vector<unsigned char> sieved(SieveSites sieve, const Around& around, std::size_t one) {
  std::vector<unsigned char> possible(around.count + obstacle_padding, 2);
  sieve(around.view(), one, around.rule, possible.data());
  possible.resize(around.count);
  return possible;
}

TEST(SiteKernels, RejectNoSiteThatCanCarryAGrainAndMostOfTheOthers) {
  int sites = 0, kept = 0, pairs = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    const Around around(seed);
    for (std::size_t i = 0; i < around.count; ++i) {
      const std::vector<unsigned char> possible = sieved(site_kernels_portable, around, i);
      for (std::size_t j = i + 1; j < around.count; ++j) {
        ASSERT_LE(possible[j], 1) << "seed " << seed << ", pair " << i << " " << j << " was not written";
        if (i == around.floor || j == around.floor) {
          EXPECT_EQ(possible[j], 1) << "the floor, seed " << seed;
          continue;
        }
        const bool carries = around.carries(i, j);
        EXPECT_LE(carries, possible[j] != 0) << "seed " << seed << ", pair " << i << " " << j;
        ++pairs;
        sites += carries;
        kept += possible[j];
      }
    }
  }
  EXPECT_GT(sites, 1000);  // or nothing was tried
  EXPECT_LT(kept - sites, (pairs - sites) / 20);
}

TEST(SiteKernels, SayTheSameOnEveryInstructionSet) {
  if (!runs_here(InstructionSet::avx2)) GTEST_SKIP() << "no AVX2 here";
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    const Around around(seed);
    for (std::size_t i = 0; i < around.count; ++i)
      EXPECT_EQ(sieved(site_kernels_portable, around, i), sieved(site_kernels_avx2, around, i))
          << "seed " << seed << ", obstacle " << i;
  }
}

}  // namespace
}  // namespace talus
