#include "kernels/detection/broad_phase.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/bodies/motion.hpp"
#include "kernels/detection/narrow_phase.hpp"
#include "kernels/detection/skin_escape.hpp"
#include "kernels/law/gap_law.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::pairs_by_brute_force;
using test::Random;
using test::uniform;
using test::uniform_vector;

/// All pairs, from cells dealt to three parts of unequal size, as threads would.
std::vector<GrainPair> pairs_from_cells(std::span<const Vec3> x, std::span<const double> reach) {
  const CellGrid grid = build_cells(x, reach);
  const std::size_t n = grid.cells.size();
  std::vector<std::vector<GrainPair>> parts(3);
  find_pairs(grid, 0, n / 7, parts[1]);
  find_pairs(grid, n / 7, n / 2, parts[2]);
  find_pairs(grid, n / 2, n, parts[0]);
  return sort_pairs(parts, x.size());
}

/// Equal lists: none is missing, none comes twice, the order is that of (first, second); and the same when
/// every cell is a part of its own, so that every search begins anew.
void expect_all_pairs(const std::vector<Vec3>& x, const std::vector<double>& reach) {
  const std::vector<GrainPair> expected = pairs_by_brute_force(x, reach);
  const std::vector<GrainPair> found = pairs_from_cells(x, reach);
  EXPECT_EQ(found.size(), expected.size());
  EXPECT_TRUE(found == expected);
  const CellGrid grid = build_cells(x, reach);
  std::vector<std::vector<GrainPair>> parts(1);
  for (std::size_t c = 0; c < grid.cells.size(); ++c) find_pairs(grid, c, c + 1, parts[0]);
  EXPECT_TRUE(sort_pairs(parts, x.size()) == expected);
}

struct Cloud {
  std::vector<Vec3> x;
  std::vector<double> reach;
};

/// Radii between 1 and `ratio`, as many small ones as volume would have it; room for some thousand pairs.
Cloud polydisperse_cloud(std::size_t count, double ratio, std::uint64_t seed) {
  Random random(seed);
  Cloud cloud;
  for (std::size_t k = 0; k < count; ++k) {
    const double r = k % 50 == 0 ? uniform(random, 0.3, 1.0) * ratio : uniform(random, 1, 1.5);
    cloud.reach.push_back(r);
    cloud.x.push_back(uniform_vector(random, -4 * ratio, 4 * ratio));
    // Every third body sits on the surface of the last large one, where cells of different levels meet.
    if (k % 3 == 1)
      cloud.x.back() = cloud.x[k / 50 * 50] + uniform_vector(random, -1, 1).normalized() *
                                                  (cloud.reach[k / 50 * 50] + r + uniform(random, -0.5, 0.5));
  }
  return cloud;
}

TEST(BroadPhase, FindsEveryPairOfAUniformCloudOnce) {
  for (std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    Cloud cloud;
    for (int k = 0; k < 1500; ++k) {
      cloud.x.push_back(uniform_vector(random, -12, 9));
      cloud.reach.push_back(uniform(random, 0.5, 0.9));
    }
    expect_all_pairs(cloud.x, cloud.reach);
  }
}

TEST(BroadPhase, FindsEveryPairOfADensePacking) {
  const Bodies bodies = test::jittered_lattice(11, 5);
  std::vector<double> reach = bodies.radius;
  for (double& r : reach) r += 0.05;
  EXPECT_GT(pairs_by_brute_force(bodies.x, reach).size(), 2 * bodies.size());
  expect_all_pairs(bodies.x, reach);
}

TEST(BroadPhase, FindsEveryPairBetweenRadiiOneToAHundredAndToAThousand) {
  for (double ratio : {2.0, 3.99, 100.0, 1000.0}) {
    const Cloud cloud = polydisperse_cloud(1500, ratio, 17);
    EXPECT_GT(pairs_by_brute_force(cloud.x, cloud.reach).size(), 300u) << "ratio " << ratio;
    expect_all_pairs(cloud.x, cloud.reach);
  }
}

// Equal spheres at exactly the size of a cell, 2e5 cells from the origin: the quotient's rounding decides
// between cells k and k + 2.
TEST(BroadPhase, LosesNoPairToRoundingOnAnExactLattice) {
  for (double spacing : {0.1, 1.0 / 3, 0.7, 0.3}) {
    std::vector<Vec3> x;
    for (int k = 0; k < 2000; ++k)
      x.push_back(spacing * Vec3(k % 10 + (k < 1100 ? 0 : 210000), k / 10 % 10,
                                 k / 100 % 10 - (k < 1100 ? 0 : 250000)));
    const std::vector<double> reach(x.size(), 0.5 * spacing * (1 + 1e-11));
    expect_all_pairs(x, reach);
  }
}

TEST(BroadPhase, AllBodiesInOnePointArePairsOfEachOther) {
  const std::vector<Vec3> x(60, Vec3(1, -2, 3));
  const std::vector<double> reach(60, 0.25);
  const auto found = pairs_from_cells(x, reach);
  EXPECT_EQ(found.size(), 60u * 59u / 2);
  expect_all_pairs(x, reach);
}

TEST(BroadPhase, OneBodyAndNoBodyHaveNoPairs) {
  EXPECT_TRUE(pairs_from_cells({}, {}).empty());
  EXPECT_TRUE(pairs_from_cells(std::vector<Vec3>{{1, 2, 3}}, std::vector<double>{1.0}).empty());
}

TEST(BroadPhase, BodiesThatFlewABillionMetresAwayDisturbNobody) {
  Bodies bodies = test::jittered_lattice(8, 9);
  std::vector<double> reach = bodies.radius;
  for (double& r : reach) r += 0.05;
  const CellGrid before = build_cells(bodies.x, reach);
  Random random(3);
  for (const Vec3& away : {Vec3(-1e9, 0, 0), Vec3(0, -1e9, 1e9), Vec3(1e9, 1e9, 1e9), Vec3(-1e9, -1e9, -1e9)})
    for (int k = 0; k < 4; ++k) {
      bodies.x.push_back(away + uniform_vector(random, -1, 1));
      reach.push_back(0.7);
    }
  expect_all_pairs(bodies.x, reach);
  // The others keep cells of their own: detection does not fall back to comparing all with all.
  EXPECT_GE(build_cells(bodies.x, reach).cells.size(), before.cells.size() / 2);
}

// Cells that do not count so far are clamped into one, and detection was quadratic.
TEST(BroadPhase, GrainsOnALongLineShareNoCellWithMany) {
  for (const Vec3& along : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(1, 1, 1)}) {
    std::vector<Vec3> x;
    for (int k = 0; k < 20000; ++k) x.emplace_back(200.0 * k * along);
    for (int k = 0; k < 20; ++k) x.emplace_back(1e12 * along + Vec3(1.5 * k, 0, 0));  // and a few far away
    const std::vector<double> reach(x.size(), 1);
    const CellGrid grid = build_cells(x, reach);
    for (const CellGrid::Cell& cell : grid.cells) ASSERT_LE(cell.end - cell.begin, 300);
    std::vector<std::vector<GrainPair>> pairs(1);
    find_pairs(grid, 0, grid.cells.size(), pairs[0]);
    EXPECT_EQ(sort_pairs(pairs, x.size()).size(), 19U);
  }
}

// Cells are counted up to 2^18 on each side; what is farther away stands in the outermost of them. A chain on
// each axis goes from within to there, with smaller bodies beside it.
TEST(BroadPhase, FindsPairsAcrossTheOutermostCells) {
  std::vector<Vec3> x;
  std::vector<double> reach;
  for (int k = 0; k < 3000; ++k) {  // whose medians are the origin, and whose reach the size of cells, 1
    x.push_back(Vec3(k % 2 ? 1 : -1, k % 3 - 1, k % 5 - 2));
    reach.push_back(0.5);
  }
  constexpr double edge = 1 << 18;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0})
      for (int k = -600; k<600; k += std::abs(k)> 540 ? 1 : 20) {  // close to 570, where cells end
        x.push_back(0.9 * k * side * Vec3::Unit(axis) + edge * side * Vec3::Unit(axis));
        reach.push_back(0.5);
        x.push_back(x.back() + 0.6 * Vec3::Unit((axis + 1) % 3));
        reach.push_back(0.24);
      }
  expect_all_pairs(x, reach);
}

TEST(BroadPhase, OneInfiniteReachMeetsAll) {
  Random random(2);
  Cloud cloud;
  for (int k = 0; k < 300; ++k) {
    cloud.x.push_back(uniform_vector(random, -5, 5));
    cloud.reach.push_back(k == 7 ? std::numeric_limits<double>::infinity() : 0.4);
  }
  expect_all_pairs(cloud.x, cloud.reach);
}

TEST(BroadPhase, NoPairMeansMoreThanCellsCanCount) {
  std::vector<Vec3> x;
  for (int k = 0; k < 40; ++k) x.push_back(std::pow(10.0, k % 20) * Vec3(k % 2 ? 1 : -1, 0.5, -0.1));
  expect_all_pairs(x, std::vector<double>(x.size(), 1.0));
}

// By blocks of bodies, wherever these lie: the same contacts as one by one.
TEST(SkinEscape, MeetWhomTheyTouch) {
  for (const int n : {1, 2, 63, 64, 65, 1000}) {
    Random random(static_cast<std::uint64_t>(n));
    Bodies bodies;
    std::vector<double> reach;
    const double edge = 1.5 * std::cbrt(static_cast<double>(n));
    for (int k = 0; k < n; ++k) {
      add_sphere(bodies, BodyId{1000 - k}, uniform_vector(random, 0, edge),
                 k % 40 == 3 ? 4 : uniform(random, 0.2, 0.6), 1);
      const Vec3 u = uniform_vector(random, -1, 1);
      std::copy_n(u.data(), 3, bodies.velocity.back().u);
      // Every seventh has left.
      reach.push_back(k % 7 == 0 ? 0 : bodies.radius.back() + 0.1);
    }
    const std::vector<Vec3> x_then = bodies.x;
    const Margins margins{x_then, reach, 0.02, 0.03};
    std::vector<Escape> skin_escapes;
    find_skin_escapes({0, bodies.size()}, bodies, margins, skin_escapes);
    std::sort(skin_escapes.begin(), skin_escapes.end());
    ASSERT_EQ(skin_escapes.size(), static_cast<std::size_t>((n + 6) / 7));
    std::vector<Encounter> needed, known, expected;
    compare_skin_escapes(skin_escapes, bodies, {}, margins, needed, known);
    for (std::size_t i = 0; i < bodies.size(); ++i)
      for (std::size_t j = 0; j < bodies.size(); ++j) {
        if (i == j || i % 7 != 0) continue;
        const Vec3 d = bodies.x[i] - bodies.x[j];
        using Map = Eigen::Map<const Vec3>;
        const double v_n = d.normalized().dot(Map(bodies.velocity[i].u) - Map(bodies.velocity[j].u));
        if (!stays_apart(d.norm() - bodies.radius[i] - bodies.radius[j], v_n, 0.02, 0.03))
          expected.push_back(
              {std::min(static_cast<std::int64_t>(bodies.id[i]), static_cast<std::int64_t>(bodies.id[j])),
               std::max(static_cast<std::int64_t>(bodies.id[i]), static_cast<std::int64_t>(bodies.id[j]))});
      }
    for (auto* list : {&needed, &expected}) {
      std::sort(list->begin(), list->end());
      list->erase(std::unique(list->begin(), list->end()), list->end());
    }
    EXPECT_EQ(needed, expected) << n << " bodies";
    EXPECT_TRUE(n < 100 || expected.size() > 50);
  }
}

/// Grains that jostle at random: what the step does, in small. At each step every pair that the narrow phase
/// would take for a contact must stand among the candidates.
TEST(Candidates, HoldEveryContactUntilAGrainThatLeftItsMarginMeetsOneMore) {
  constexpr double h = 1e-2, alert = 0.03, skin = 0.12;
  for (std::uint64_t seed : {1, 2}) {
    Random random(seed);
    Bodies bodies = test::jittered_lattice(6, seed, 0);
    const std::size_t n = bodies.size();
    std::vector<Vec3> x_then;
    std::vector<double> reach_then(n);
    Candidates candidates;
    const std::vector<Wall> walls = test::box_of_walls(-1, 6);
    const auto velocity = [&](std::size_t s) { return Eigen::Map<Vec3>(bodies.velocity[s].u); };
    const auto move = [&] {
      for (std::size_t s = 0; s < n; ++s) bodies.x[s] += 0.5 * h * velocity(s);
    };
    int searches = 0, held = 0, steps = 400;
    for (int step = 0; step < steps; ++step) {
      for (std::size_t s = 0; s < n; ++s) velocity(s) = 0.9 * velocity(s) + uniform_vector(random, -0.1, 0.1);
      if (step % 90 == 89) velocity(static_cast<std::size_t>(step) % n) *= 40;  // one shoots off
      move();
      const Margins margins{x_then, reach_then, h, alert, Vec3::Zero(), walls};
      bool holds = step > 0;
      if (holds) {
        std::vector<Escape> skin_escapes;
        std::vector<Encounter> needed, known;
        find_skin_escapes({0, n}, bodies, margins, skin_escapes);
        std::sort(skin_escapes.begin(), skin_escapes.end());
        compare_skin_escapes(skin_escapes, bodies, candidates, margins, needed, known);
        holds = all_known(needed, known);
        held += holds && !skin_escapes.empty();
      }
      if (!holds) {
        ++searches;
        x_then = bodies.x;
        for (std::size_t s = 0; s < n; ++s)
          reach_then[s] = bodies.radius[s] + 0.5 * skin + contact_margin(velocity(s).norm(), h, alert);
        candidates.grain_pairs = pairs_from_cells(x_then, reach_then);
        candidates.wall_pairs.clear();
        for (std::size_t w = 0; w < walls.size(); ++w)
          for (std::size_t s = 0; s < n; ++s)
            if (walls[w].normal.dot(x_then[s] - walls[w].point) < reach_then[s] + 0.5 * alert)
              candidates.wall_pairs.push_back({static_cast<std::int32_t>(w), static_cast<Slot>(s)});
      }
      for (std::size_t w = 0; w < walls.size(); ++w)
        for (std::size_t s = 0; s < n; ++s) {
          const double gap = walls[w].normal.dot(bodies.x[s] - walls[w].point) - bodies.radius[s];
          if (gap >= alert && gap >= -h * walls[w].normal.dot(velocity(s))) continue;
          const WallPair pair{static_cast<std::int32_t>(w), static_cast<Slot>(s)};
          ASSERT_NE(std::find(candidates.wall_pairs.begin(), candidates.wall_pairs.end(), pair),
                    candidates.wall_pairs.end())
              << "step " << step << ": grain " << s << " at wall " << w << " with gap " << gap;
        }
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = i + 1; j < n; ++j) {
          const Vec3 d = bodies.x[i] - bodies.x[j];
          const double gap = d.norm() - bodies.radius[i] - bodies.radius[j];
          const double v_n = d.normalized().dot(velocity(i) - velocity(j));
          if (gap >= alert && gap >= -h * v_n) continue;
          const GrainPair pair{static_cast<Slot>(i), static_cast<Slot>(j)};
          ASSERT_TRUE(std::binary_search(candidates.grain_pairs.begin(), candidates.grain_pairs.end(), pair,
                                         [](const GrainPair& a, const GrainPair& b) {
                                           return a.first != b.first ? a.first < b.first
                                                                     : a.second < b.second;
                                         }))
              << "step " << step << ": pair " << i << ", " << j << " with gap " << gap;
        }
      move();
    }
    EXPECT_GT(searches, 5);
    EXPECT_GT(held, 5) << "grains outside of their margins that meet no one new";
    EXPECT_LT(searches, steps / 3) << "candidates are to be kept for many steps";
  }
}

}  // namespace
}  // namespace talus
