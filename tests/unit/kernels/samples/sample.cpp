#include "kernels/samples/sample.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "kernels/samples/detail/radius_slices.hpp"
#include "kernels/samples/resting_site.hpp"

namespace talus {
namespace {

using Kind = SizeDistribution::Kind;

std::vector<double> uniform_radii(std::size_t n, double ratio, std::uint64_t seed = 1) {
  return draw_radii({Kind::uniform, 2 / (1 + ratio), 2 * ratio / (1 + ratio)}, n, seed);
}

/// Contact normals of grain k, towards it, with grains placed before it, walls and floor.
std::vector<Vec3> supports(std::size_t k, const std::vector<Vec3>& x, const std::vector<double>& r, double lx,
                           double ly) {
  const double touch = 1e-9 * r[k];
  std::vector<Vec3> normals;
  for (std::size_t j = 0; j < k; ++j)
    if ((x[k] - x[j]).norm() < r[k] + r[j] + touch) normals.push_back((x[k] - x[j]).normalized());
  if (x[k][2] < r[k] + touch) normals.push_back(Vec3::UnitZ());
  if (x[k][0] < r[k] + touch) normals.push_back(Vec3::UnitX());
  if (x[k][0] > lx - r[k] - touch) normals.push_back(-Vec3::UnitX());
  if (x[k][1] < r[k] + touch) normals.push_back(Vec3::UnitY());
  if (x[k][1] > ly - r[k] - touch) normals.push_back(-Vec3::UnitY());
  return normals;
}

/// Whether some three of the normals carry a weight: e_z = sum lambda n with lambda >= 0.
bool carries_weight(const std::vector<Vec3>& normals) {
  for (std::size_t a = 0; a < normals.size(); ++a)
    for (std::size_t b = a + 1; b < normals.size(); ++b)
      for (std::size_t c = b + 1; c < normals.size(); ++c) {
        Eigen::Matrix3d n;
        n << normals[a], normals[b], normals[c];
        if (std::abs(n.determinant()) < 1e-9) continue;
        if ((n.inverse() * Vec3::UnitZ()).minCoeff() > -1e-7) return true;
      }
  return false;
}

/// Depth of the worst overlap of grains with each other and with floor and walls, by brute force [m].
double worst_overlap(const std::vector<Vec3>& x, const std::vector<double>& r, double lx, double ly) {
  double worst = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    for (std::size_t j = 0; j < k; ++j) worst = std::max(worst, r[k] + r[j] - (x[k] - x[j]).norm());
    for (double gap : {x[k][0], x[k][1], x[k][2], lx - x[k][0], ly - x[k][1]})
      worst = std::max(worst, r[k] - gap);
  }
  return worst;
}

/// The lowest stable place for a sphere of radius r among the grains given, by trying every triple of
/// supports.
double lowest_place(double r, const std::vector<Vec3>& x, const std::vector<double>& radius, double lx,
                    double ly) {
  // Every support as the set |c - centre| = reach or normal . c = level.
  struct Support {
    bool round;
    Vec3 v;
    double reach;
  };
  std::vector<Support> all;
  for (std::size_t k = 0; k < x.size(); ++k) all.push_back({true, x[k], radius[k] + r});
  all.push_back({false, Vec3::UnitZ(), r});
  all.push_back({false, Vec3::UnitX(), r});
  all.push_back({false, -Vec3::UnitX(), r - lx});
  all.push_back({false, Vec3::UnitY(), r});
  all.push_back({false, -Vec3::UnitY(), r - ly});
  const auto gap = [](const Support& s, const Vec3& c) {
    return s.round ? (c - s.v).norm() - s.reach : s.v.dot(c) - s.reach;
  };

  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < all.size(); ++a)
    for (std::size_t b = a + 1; b < all.size(); ++b)
      for (std::size_t d = b + 1; d < all.size(); ++d) {
        const std::array<const Support*, 3> three{&all[a], &all[b], &all[d]};
        // Newton from above and from both sides: independent of the closed form under test.
        for (const Vec3& push :
             {Vec3(0, 0, 1), Vec3(1, 0.3, 0), Vec3(-1, -0.3, 0), Vec3(0.3, -1, 0), Vec3(-0.3, 1, 0)}) {
          Vec3 c = Vec3::Zero();
          int round = 0;
          for (const Support* s : three)
            if (s->round) {
              c += s->v;
              ++round;
            }
          c = round ? Vec3(c / round + 1.5 * r * push) : Vec3(0.5 * lx, 0.5 * ly, r);
          Vec3 g;
          for (int i = 0; i < 30; ++i) {
            Eigen::Matrix3d jacobian;
            for (int m = 0; m < 3; ++m) {
              const Support& s = *three[static_cast<std::size_t>(m)];
              g[m] = gap(s, c);
              jacobian.row(m) = s.round ? (c - s.v).normalized() : s.v;
            }
            if (g.norm() < 1e-13 || !(std::abs(jacobian.determinant()) > 1e-9)) break;
            c -= jacobian.inverse() * g;
          }
          if (!(g.norm() < 1e-11) || c[2] >= lowest) continue;
          std::vector<Vec3> normals;
          for (const Support* s : three) normals.push_back(s->round ? Vec3((c - s->v).normalized()) : s->v);
          if (!carries_weight(normals)) continue;
          if (std::all_of(all.begin(), all.end(), [&](const Support& s) { return gap(s, c) > -1e-10; }))
            lowest = c[2];
        }
      }
  return lowest;
}

TEST(DrawRadii, GrainDependsOnSeedAndIndexOnly) {
  const SizeDistribution sizes{Kind::uniform, 1, 2};
  const auto few = draw_radii(sizes, 10, 7), many = draw_radii(sizes, 1000, 7),
             other = draw_radii(sizes, 10, 8);
  EXPECT_TRUE(std::equal(few.begin(), few.end(), many.begin()));
  for (std::size_t k = 0; k < few.size(); ++k) EXPECT_NE(few[k], other[k]);
}

TEST(DrawRadii, SameBitsOnEveryMachine) {
  // Known answer of philox4x32-10 for key 0, counter 0 (Random123, kat_vectors): words 6627e8d5 e169c58d
  // bc57ac4c 9b00dbd8.
  const double u = static_cast<double>(0x6627e8d5e169c58dULL >> 11) * 0x1p-53;
  EXPECT_EQ(draw_radii({Kind::uniform, 1, 2}, 1, 0)[0], 1 + u);
}

TEST(DrawRadii, ConstantIsAllMax) {
  for (double r : draw_radii({Kind::constant, 0, 0.5}, 5, 1)) EXPECT_EQ(r, 0.5);
}

TEST(DrawRadii, UniformByVolumeGivesEveryClassTheSameVolume) {
  const std::size_t n = 200000;
  const auto radii = draw_radii({Kind::uniform_volume, 1, 3}, n, 3);
  std::array<double, 4> volume{};  // by radius in [1, 1.5), [1.5, 2), [2, 2.5), [2.5, 3]
  for (double r : radii) {
    ASSERT_GE(r, 1);
    ASSERT_LE(r, 3);
    volume[std::min<std::size_t>(static_cast<std::size_t>((r - 1) * 2), 3)] += r * r * r;
  }
  const double mean = std::accumulate(volume.begin(), volume.end(), 0.0) / 4;
  // The largest class has about 9000 grains: a relative standard deviation of 1.1 %.
  for (double v : volume) EXPECT_NEAR(v, mean, 0.04 * mean);
}

TEST(DrawRadii, ImpossibleRangesAreRefused) {
  EXPECT_THROW(draw_radii({Kind::uniform, 2, 1}, 1, 1), std::invalid_argument);
  EXPECT_THROW(draw_radii({Kind::uniform, 0, 1}, 1, 1), std::invalid_argument);
  EXPECT_THROW(draw_radii({Kind::constant, 0, -1}, 1, 1), std::invalid_argument);
  EXPECT_TRUE(draw_radii({Kind::uniform, 1, 2}, 0, 1).empty());
}

TEST(RestingSite, OnThreeEqualSpheresIsTheTetrahedron) {
  // Unit spheres that touch each other: a fourth rests sqrt(8/3) above their plane.
  const Obstacle b = grain_obstacle({2, 0, 0}, 1, 1), c = grain_obstacle({1, std::sqrt(3.0), 0}, 1, 1);
  SiteCurve curve;
  ASSERT_TRUE(site_curve(1, b, c, 1, curve));
  RadiusRanges ranges{{0.01, 10}};
  keep_real(curve, ranges);
  keep_stable(curve, b, c, 0, ranges);
  ASSERT_EQ(ranges.size(), 1u);
  EXPECT_NEAR(ranges[0].low, 2 / std::sqrt(3.0) - 1, 1e-12);  // smaller ones fall through
  EXPECT_EQ(ranges[0].high, 10);
  EXPECT_NEAR((curve.at(1) - Vec3(1, 1 / std::sqrt(3.0), std::sqrt(8.0 / 3))).norm(), 0, 1e-12);
}

TEST(RestingSite, GrainInTheWayCutsTheRangeWhereItTouches) {
  const Obstacle b = grain_obstacle({2, 0, 0}, 1, 1), c = grain_obstacle({1, std::sqrt(3.0), 0}, 1, 1);
  SiteCurve curve;
  ASSERT_TRUE(site_curve(1, b, c, 1, curve));
  const Obstacle above = grain_obstacle({1, 1 / std::sqrt(3.0), 2.5}, 0.4, 1);
  RadiusRanges ranges{{0.2, 2}};
  keep_clear(curve, above, 0, ranges);
  ASSERT_EQ(ranges.size(), 1u);
  const double r = ranges[0].high;
  EXPECT_NEAR((curve.at(r) - above.d).norm(), r + 0.4, 1e-12);
  EXPECT_EQ(ranges[0].low, 0.2);
}

TEST(Deposition, NoGrainOverlapsAnother) {
  for (double ratio : {1.0, 1.2, 2.5}) {
    const auto radii = uniform_radii(1500, ratio);
    EXPECT_LT(worst_overlap(deposit(radii, 16, 14), radii, 16, 14), 1e-9) << "radius ratio " << ratio;
  }
}

TEST(Deposition, EveryGrainRestsOnThreeSupportsThatCarryIt) {
  for (double ratio : {1.0, 1.2, 2.5}) {
    const auto radii = uniform_radii(1500, ratio);
    const auto x = deposit(radii, 16, 14);
    for (std::size_t k = 0; k < x.size(); ++k) {
      const auto normals = supports(k, x, radii, 16, 14);
      ASSERT_GE(normals.size(), 3u) << "grain " << k << ", radius ratio " << ratio;
      ASSERT_TRUE(carries_weight(normals)) << "grain " << k << ", radius ratio " << ratio;
    }
  }
}

TEST(Deposition, EveryGrainTakesTheLowestPlace) {
  for (std::uint64_t seed : {1, 2}) {
    const auto radii = uniform_radii(45, 1.8, seed);
    const auto x = deposit(radii, 5.5, 5);
    for (std::size_t k = 12; k < x.size(); k += 4) {  // brute force costs k^3
      const std::vector<Vec3> before(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(k));
      const std::vector<double> r(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(k));
      EXPECT_NEAR(x[k][2], lowest_place(radii[k], before, r, 5.5, 5), 1e-9)
          << "grain " << k << ", seed " << seed;
    }
  }
}

TEST(RadiusSlices, HalveTheirRadiiAndHoldEachRadiusOnceALevel) {
  const detail::RadiusSlices slices(0.01, 0.03);
  EXPECT_EQ(slices.low(1), 0.01);
  for (std::size_t k = 1; k < detail::RadiusSlices::leaves; ++k) {
    EXPECT_EQ(slices.low(2 * k), slices.low(k));
    EXPECT_EQ(slices.high(2 * k), slices.low(2 * k + 1));
    EXPECT_EQ(slices.high(2 * k + 1), slices.high(k));
  }
  for (const double radius : {0.01, 0.0125, 0.02, 0.0200000001, 0.03})
    for (const std::size_t slice : slices.around(radius)) {
      EXPECT_GE(radius, slices.low(slice)) << slice;
      EXPECT_LT(radius, slices.high(slice)) << slice;
    }
}

TEST(RadiusSlices, OfEqualRadiiTheLastOfEachLevelHoldsThem) {
  const detail::RadiusSlices slices(0.01, 0.01);
  for (const std::size_t slice : slices.around(0.01))
    EXPECT_EQ(slices.high(slice), std::numeric_limits<double>::infinity());
}

TEST(Deposition, FirstGrainLiesInTheFirstCorner) {
  const std::vector<double> one{0.5};
  EXPECT_EQ(deposit(one, 3, 4)[0], Vec3(0.5, 0.5, 0.5));
  EXPECT_TRUE(deposit(std::vector<double>{}, 3, 4).empty());
}

TEST(Deposition, SmallPolydispersityGivesALooseRandomPacking) {
  const auto radii = uniform_radii(4000, 1.2);
  const auto x = deposit(radii, 24, 24);
  double top = 0;
  for (const Vec3& c : x) top = std::max(top, c[2]);
  double volume = 0;  // of grains with their centre in the inner half
  int grains = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const bool inner = x[k][2] > top / 4 && x[k][2] < 3 * top / 4 && std::abs(x[k][0] - 12) < 9 &&
                       std::abs(x[k][1] - 12) < 9;
    if (!inner) continue;
    volume += 4.0 / 3 * M_PI * std::pow(radii[k], 3);
    ++grains;
  }
  const double fraction = volume / (18 * 18 * top / 2);
  EXPECT_GT(grains, 500);
  EXPECT_GT(fraction, 0.55);
  EXPECT_LT(fraction, 0.64);  // random loose to random close packing
}

TEST(Deposition, SmallPolydispersityBreaksTheCrystalOfEqualRadii) {
  // A square lattice face shows as neighbours at sqrt(2) diameters; a random packing has next to nothing
  // special there.
  const auto share_at_sqrt2 = [](double ratio) {
    const auto radii = uniform_radii(3000, ratio);
    const auto x = deposit(radii, 24, 24);
    int at = 0, around = 0;
    for (std::size_t k = 0; k < x.size(); ++k)
      for (std::size_t j = 0; j < k; ++j) {
        const double distance = (x[k] - x[j]).norm() / (radii[k] + radii[j]);
        at += distance > 1.39 && distance < 1.44;
        around += distance > 1.29 && distance < 1.54;
      }
    return static_cast<double>(at) / around;
  };
  EXPECT_GT(share_at_sqrt2(1), 0.9);
  EXPECT_LT(share_at_sqrt2(1.05), 0.25);  // an even spread gives 0.2
}

TEST(Deposition, ScalesWithTheUnitOfLength) {
  // Powers of two scale exactly: a sample in other units is the same sample, bit for bit.
  const auto radii = uniform_radii(600, 1.5);
  std::vector<double> small(radii);
  for (double& r : small) r *= 0x1p-10;
  const auto x = deposit(radii, 12, 12), y = deposit(small, 12 * 0x1p-10, 12 * 0x1p-10);
  for (std::size_t k = 0; k < x.size(); ++k) ASSERT_EQ(x[k] * 0x1p-10, y[k]) << "grain " << k;
}

TEST(Deposition, GrainsThatCannotFitAreRefused) {
  EXPECT_THROW(deposit(std::vector<double>{0.5, 2}, 3, 9), std::invalid_argument);
  EXPECT_THROW(deposit(std::vector<double>{0.5, -1}, 3, 9), std::invalid_argument);
}

TEST(LatticeSites, JitteredGrainsStillDoNotOverlap) {
  for (auto kind : {Lattice::Kind::cubic, Lattice::Kind::hexagonal}) {
    const auto radii = uniform_radii(700, 1.3);
    const double largest = *std::max_element(radii.begin(), radii.end());
    Lattice sites{kind, 2 * (largest + 0.1), 20, 18, 0, 0.1, 5};
    const auto x = lattice(radii, sites);
    EXPECT_EQ(x.size(), radii.size());
    EXPECT_LE(worst_overlap(x, radii, 20, 18), 1e-12);
    sites.spacing *= 0.99;
    EXPECT_THROW(lattice(radii, sites), std::invalid_argument);
  }
}

TEST(LatticeSites, HexagonalFillsSpaceAsClosePackingDoes) {
  const std::vector<double> radii(2000, 0.5);
  const auto x = lattice(radii, {Lattice::Kind::hexagonal, 1, 11, 10.3, 0, 0, 1});
  // Twelve neighbours at one spacing for a grain inside.
  const Vec3 inside(5.5, 5, 5);
  const auto middle = *std::min_element(x.begin(), x.end(), [&](const Vec3& a, const Vec3& b) {
    return (a - inside).norm() < (b - inside).norm();
  });
  EXPECT_EQ(std::count_if(x.begin(), x.end(),
                          [&](const Vec3& c) { return std::abs((c - middle).norm() - 1) < 1e-9; }),
            12);
}

TEST(LatticeSites, NarrowBaseIsRefused) {
  EXPECT_THROW(lattice(std::vector<double>{1}, {Lattice::Kind::cubic, 2, 1.9, 10, 0, 0, 1}),
               std::invalid_argument);
}

TEST(Column, NeighboursTouch) {
  const std::vector<double> radii{0.5, 1, 0.25};
  const auto x = column(radii, Vec3(1, 2, 0));
  EXPECT_EQ(x[0], Vec3(1, 2, 0.5));
  EXPECT_EQ(x[1], Vec3(1, 2, 2));
  EXPECT_EQ(x[2], Vec3(1, 2, 3.25));
}

}  // namespace
}  // namespace talus
