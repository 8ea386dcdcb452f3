#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "partition/detail/cell_graph.hpp"
#include "partition/partitioner.hpp"
#include "partition/partitioners.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/decomposition.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::Random;
using test::uniform;
using test::uniform_vector;

/// Every way there is: a new one has to pass what all pass.
const std::vector<PartitionKind> kinds = [] {
  std::vector<PartitionKind> all;
  for (const auto& partitioner : partitioner_registry()) all.push_back(partitioner.kind);
  return all;
}();

PartitionPoints random_points(std::size_t n, std::uint64_t seed, bool weights = false) {
  Random random(seed);
  PartitionPoints points;
  for (std::size_t k = 0; k < n; ++k) {
    points.x.push_back(uniform_vector(random, -1, 1).cwiseProduct(Vec3(3, 2, 1)));
    points.half.push_back(uniform_vector(random, -0.05, 0.05));
    if (weights) points.weight.push_back(static_cast<std::int32_t>(random() % 40));
  }
  return points;
}

PartitionOptions options_of(PartitionKind kind, std::int32_t subdomains) {
  PartitionOptions options;
  options.kind = kind;
  options.subdomains = subdomains;
  return options;
}

/// What the regions do to a fine lattice of places in and around the sample.
std::vector<SubdomainId> map_of(const Partition& partition) {
  std::vector<SubdomainId> map;
  for (int k = 0; k < 8000; ++k)
    map.push_back(partition.subdomain_of(
        {-4 + 8.0 / 19 * (k % 20), -3 + 6.0 / 19 * (k / 20 % 20), -2 + 4.0 / 19 * (k / 400)}));
  return map;
}

std::vector<PartitionPoints> deal(const PartitionPoints& all, std::size_t ranks, std::uint64_t seed) {
  Random random(seed);
  std::vector<std::size_t> order(all.x.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  std::vector<PartitionPoints> parts(ranks);
  for (std::size_t k : order) {
    PartitionPoints& part = parts[random() % ranks];
    part.x.push_back(all.x[k]);
    part.half.push_back(all.half[k]);
    if (!all.weight.empty()) part.weight.push_back(all.weight[k]);
  }
  return parts;
}

TEST(Partition, EveryPointOfSpaceIsInExactlyOneSubdomain) {
  const PartitionPoints points = random_points(3000, 1);
  for (PartitionKind kind : kinds)
    for (std::int32_t n : {1, 2, 3, 7, 12, 96}) {
      const Partition partition = make_partition(points, options_of(kind, n));
      std::set<SubdomainId> met;
      for (const SubdomainId subdomain : map_of(partition)) {
        ASSERT_GE(subdomain.value(), 0);
        ASSERT_LT(subdomain.value(), n);
      }
      for (const SubdomainId subdomain : subdomains_of(partition, points.x)) met.insert(subdomain);
      EXPECT_EQ(met.size(), static_cast<std::size_t>(n)) << name_of(kind) << ": a subdomain is empty";
      EXPECT_NE(partition.kind, PartitionKind::automatic);
    }
}

TEST(Partition, BisectionDividesUnitWeightsToThePoint) {
  const PartitionPoints points = random_points(10007, 2);
  for (PartitionKind kind : {PartitionKind::rcb, PartitionKind::fitted})
    for (std::int32_t n : {2, 3, 5, 16, 96, 100}) {
      const auto weights = weight_per_subdomain(make_partition(points, options_of(kind, n)), points);
      const auto [least, most] = std::minmax_element(weights.begin(), weights.end());
      EXPECT_LE(*most - *least, 2) << name_of(kind) << ", " << n;
    }
}

TEST(Partition, BisectionIsOffTheMeanByNoMoreThanTheHeaviestPointsCanCost) {
  const PartitionPoints points = random_points(5000, 3, true);
  const double heaviest = *std::max_element(points.weight.begin(), points.weight.end());
  for (PartitionKind kind : {PartitionKind::rcb, PartitionKind::fitted})
    for (std::int32_t n : {2, 3, 7, 64, 96}) {
      const auto weights = weight_per_subdomain(make_partition(points, options_of(kind, n)), points);
      const double mean =
          static_cast<double>(std::accumulate(weights.begin(), weights.end(), std::int64_t{0})) / n;
      // A cut is off by half a point at most; of the errors above it a part inherits its share, at most 2/3
      // once and about 1/2 otherwise: their sum stays below 1.5 points.
      for (std::int64_t weight : weights) EXPECT_NEAR(static_cast<double>(weight), mean, 1.5 * heaviest);
    }
}

// Ranks meet in every sum, and all of them carry all of it.
TEST(Partition, BisectionNeedsFewSumsAndShortOnesWhateverTheUnitOfTheWeights) {
  PartitionPoints points = random_points(30000, 6);
  for (std::int32_t unit : {1, 64, 640}) {
    points.weight.assign(points.x.size(), unit);
    for (std::size_t k = 0; k < points.weight.size(); k += 3) points.weight[k] += unit / 4;
    for (std::size_t k = 0; k < points.weight.size(); ++k)
      if (points.x[k][0] > 0.9) points.weight[k] *= 5;  // a subdomain that costs more
    std::size_t sums = 0, longest = 0;
    Reduction reduction;
    reduction.sum = [&](std::span<std::int64_t> values) {
      ++sums;
      longest = std::max(longest, values.size());
    };
    make_partition(points, options_of(PartitionKind::rcb, 96), reduction);
    EXPECT_LE(sums, 1u + 7 * 6) << unit;  // of seven levels each: moments, and five rounds
    EXPECT_LE(longest, 512u) << unit;
  }
}

TEST(Partition, MetisKeepsContactsWithinTheCellsAndNoRegionWithoutWeight) {
  const PartitionPoints points = random_points(40000, 4);
  const auto weights =
      weight_per_subdomain(make_partition(points, options_of(PartitionKind::metis, 24)), points);
  EXPECT_LT(imbalance(weights), 0.05);
}

TEST(Partition, OfANearlyFlatSampleByMetisHasNoMoreCellsThanPromised) {
  PartitionPoints points = random_points(3000, 3);
  for (Vec3& x : points.x) x[2] *= 1e-9;
  for (const std::int32_t n : {2, 24}) {
    const Partition partition = make_partition(points, options_of(PartitionKind::metis, n));
    EXPECT_LE(partition.table.subdomain.size(), std::size_t{1} << 18);
    EXPECT_EQ(partition.table.cells[2], 1);
  }
}

TEST(Partition, IsTheSameForAnyOrderOfPointsAndAnyNumberOfRanks) {
  for (bool weights : {false, true}) {
    const PartitionPoints points = random_points(4000, 5, weights);
    for (PartitionKind kind : kinds) {
      const auto expected = map_of(make_partition(points, options_of(kind, 13)));
      for (int count : {1, 2, 3, 7}) {
        const auto ranks = static_cast<std::size_t>(count);
        const auto parts = deal(points, ranks, ranks);
        std::vector<std::vector<SubdomainId>> maps(ranks);
        graph::on_pretend_ranks(count, [&](const graph::Communicator& all) {
          const auto rank = static_cast<std::size_t>(all.rank());
          maps[rank] = map_of(make_partition(parts[rank], options_of(kind, 13), reduction_over(all)));
        });
        for (const auto& map : maps) EXPECT_EQ(map, expected) << name_of(kind) << " on " << ranks << " ranks";
      }
    }
  }
}

TEST(Partition, ALatticeInOnePlaneOfEqualCoordinatesIsStillDivided) {
  PartitionPoints points;  // 16 x 16 x 16: a plane across z holds 256 points, more than a part
  for (int k = 0; k < 4096; ++k) points.x.push_back(Vec3(k % 16, k / 16 % 16, k / 256));
  for (PartitionKind kind : {PartitionKind::rcb, PartitionKind::fitted})
    for (std::int32_t n : {3, 48, 100}) {
      const auto weights = weight_per_subdomain(make_partition(points, options_of(kind, n)), points);
      const auto [least, most] = std::minmax_element(weights.begin(), weights.end());
      EXPECT_LE(*most - *least, 2) << name_of(kind) << ", " << n;
    }
}

TEST(Partition, DegenerateSamplesAreDealtAndNotRefused) {
  PartitionPoints none, one, same, line;
  const auto add = [](PartitionPoints& points, const Vec3& x) {
    points.x.push_back(x);
    points.half.push_back(Vec3::Zero());
  };
  add(one, {1, 2, 3});
  for (int k = 0; k < 500; ++k) {
    add(same, {1, 2, 3});
    add(line, {0, 1e-3 * k, 0});
  }
  PartitionPoints weightless = line;
  weightless.weight.assign(line.x.size(), 0);
  PartitionPoints nearly_same = same;  // one rounding apart: the frame's scale would overflow
  nearly_same.x[0][0] = std::nextafter(1.0, 2.0);
  for (const PartitionPoints& points : {none, one, same, line, weightless, nearly_same})
    for (PartitionKind kind : kinds)
      for (std::int32_t n : {1, 2, 12, 1000}) {
        const Partition partition = make_partition(points, options_of(kind, n));
        for (const SubdomainId subdomain : subdomains_of(partition, points.x)) {
          EXPECT_GE(subdomain.value(), 0);
          EXPECT_LT(subdomain.value(), n);
        }
        EXPECT_LT(partition.subdomain_of({1e300, -1e300, 0}).value(), n);
      }
  const auto equal = subdomains_of(make_partition(same, options_of(PartitionKind::rcb, 8)), same.x);
  EXPECT_EQ(std::set<SubdomainId>(equal.begin(), equal.end()).size(), 1u) << "one place, two subdomains";
}

TEST(Partition, WithFewerPointsThanSubdomainsBisectionGivesEachPointItsOwn) {
  const PartitionPoints points = random_points(11, 6);
  for (PartitionKind kind : {PartitionKind::rcb, PartitionKind::fitted, PartitionKind::metis}) {
    const auto in = subdomains_of(make_partition(points, options_of(kind, 96)), points.x);
    EXPECT_EQ(std::set<SubdomainId>(in.begin(), in.end()).size(), points.x.size()) << name_of(kind);
  }
}

TEST(Partition, BoxesAreThePapersRegularGrid) {
  PartitionPoints points;
  points.x = {Vec3(0, 0, 0), Vec3(4, 3, 2)};
  PartitionOptions options = options_of(PartitionKind::boxes, 24);
  options.boxes = {4, 3, 2};
  const Partition partition = make_partition(points, options);
  std::vector<std::int32_t> count(24, 0);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 2; ++z) {
        const SubdomainId subdomain = partition.subdomain_of({x + 0.5, y + 0.5, z + 0.5});
        ++count[subdomain.at()];
        for (double shift : {-0.49, 0.49})
          EXPECT_EQ(partition.subdomain_of({x + 0.5 + shift, y + 0.5 - shift, z + 0.5 + shift}), subdomain);
      }
  EXPECT_EQ(count, std::vector<std::int32_t>(24, 1));
}

TEST(Partition, FactorsOfBoxesFollowTheShapeOfTheSample) {
  using Boxes = std::array<std::int32_t, 3>;
  EXPECT_EQ(box_factors(8, {1, 1, 1}), (Boxes{2, 2, 2}));
  EXPECT_EQ(box_factors(96, {2, 2, 3}), (Boxes{4, 4, 6}));
  EXPECT_EQ(box_factors(7, {1, 5, 1}), (Boxes{1, 7, 1}));
  EXPECT_EQ(box_factors(1, {1, 5, 1}), (Boxes{1, 1, 1}));
}

TEST(Partition, AutomaticTakesBoxesForAnEvenSampleAndBisectionForAHeap) {
  PartitionPoints even;
  for (int k = 0; k < 8000; ++k) even.x.push_back(Vec3(k % 20, k / 20 % 20, k / 400));
  EXPECT_EQ(make_partition(even, options_of(PartitionKind::automatic, 8)).kind, PartitionKind::boxes);
  PartitionPoints heap = even;
  for (Vec3& x : heap.x) x[2] *= x[2];
  const Partition uneven = make_partition(heap, options_of(PartitionKind::automatic, 8));
  EXPECT_EQ(uneven.kind, PartitionKind::rcb);
  PartitionOptions again = options_of(PartitionKind::automatic, 8);
  again.previous = &uneven;
  EXPECT_EQ(make_partition(even, again).kind, PartitionKind::rcb) << "a change would move nearly every body";
}

TEST(Partition, BisectionKeepsItsAxesWhenTheSampleChangesALittle) {
  PartitionPoints points = random_points(20000, 7);
  for (Vec3& x : points.x) x = x.cwiseQuotient(Vec3(3, 2, 1));  // a cube: every axis is nearly the widest
  const Partition before = make_partition(points, options_of(PartitionKind::rcb, 16));
  const auto old_subdomain = subdomains_of(before, points.x);
  PartitionOptions options = options_of(PartitionKind::rcb, 16);
  options.previous = &before;
  for (Vec3 squeeze : {Vec3(0.97, 1, 1.03), Vec3(1.03, 0.97, 1), Vec3(1, 1.03, 0.97)}) {
    PartitionPoints moved = points;
    for (Vec3& x : moved.x) x = x.cwiseProduct(squeeze);
    const auto in = subdomains_of(make_partition(moved, options), moved.x);
    EXPECT_EQ(in, old_subdomain);
  }
}

TEST(Partition, MetisGivesARegionTheNumberOfTheOneItOverlaps) {
  const PartitionPoints points = random_points(20000, 8);
  const Partition before = make_partition(points, options_of(PartitionKind::rcb, 8));
  PartitionOptions options = options_of(PartitionKind::metis, 8);
  const auto stays = [&](const Partition& partition) {
    const auto a = subdomains_of(before, points.x), b = subdomains_of(partition, points.x);
    std::size_t same = 0;
    for (std::size_t k = 0; k < a.size(); ++k) same += a[k] == b[k];
    return same;
  };
  options.previous = &before;
  EXPECT_GT(stays(make_partition(points, options)), points.x.size() / 3);
}

// A pair across the lower face ties its cell of the graph to the one that holds the second body's stored
// image, which a cell that leans displaces. Without the domain it ties nothing.
TEST(Partition, MetisTiesRegionsAcrossTheFacesOfAPeriodicCell) {
  for (const double lean : {0.0, 1.0, -2.0}) {
    const Domain domain = periodic_domain({4, 4, 4}, Vec3::Zero(), {0, lean, 0});
    PartitionPoints points;
    for (int k = 0; k < 64; ++k) points.x.push_back(Vec3(k % 4 + 0.5, k / 4 % 4 + 0.5, k / 16 + 0.5));
    points.half.assign(points.x.size(), Vec3::Zero());
    points.weight.assign(points.x.size(), 1);
    const Vec3 middle(1.5, 2.5, 0.1), half(0, 0, 0.3);
    points.x.push_back(middle);
    points.half.push_back(half);
    points.weight.push_back(7);
    const IntegerFrame frame = make_frame(Vec3(Vec3::Zero()), Vec3(Vec3::Constant(4)));
    const detail::CellGraph tied = detail::build_cell_graph(points, frame, 64, {}, domain);
    ASSERT_EQ(tied.cells, (std::array<std::int32_t, 3>{4, 4, 4}));
    const CellTable table{tied.cells, {}};
    const std::size_t image = table.cell_of(frame.coordinates(domain.wrap(middle - half)));
    constexpr std::size_t upwards = 8;  // of half_neighbours
    EXPECT_EQ(tied.shared[13 * image + upwards], 7) << lean;
    EXPECT_EQ(std::accumulate(tied.shared.begin(), tied.shared.end(), std::int64_t{0}), 7);
    const detail::CellGraph open = detail::build_cell_graph(points, frame, 64, {});
    EXPECT_EQ(std::accumulate(open.shared.begin(), open.shared.end(), std::int64_t{0}), 0);
  }
}

TEST(Partition, RefusesWhatHasNoMeaningAndSaysWhy) {
  PartitionPoints points = random_points(10, 9);
  EXPECT_THROW(make_partition(points, options_of(PartitionKind::rcb, 0)), std::invalid_argument);
  PartitionOptions boxes = options_of(PartitionKind::boxes, 8);
  boxes.boxes = {2, 2, 3};
  EXPECT_THROW(make_partition(points, boxes), std::invalid_argument);
  points.weight.assign(10, 1);
  points.weight[3] = -1;
  EXPECT_THROW(make_partition(points, options_of(PartitionKind::rcb, 2)), std::invalid_argument);
  points.weight.assign(10, std::numeric_limits<std::int32_t>::max());
  EXPECT_THROW(make_partition(points, options_of(PartitionKind::rcb, 2)), std::invalid_argument);
  points.weight.clear();
  points.x[4][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(make_partition(points, options_of(PartitionKind::rcb, 2)), std::invalid_argument);
  EXPECT_THROW(partition_kind("parmetis"), std::invalid_argument);
  for (PartitionKind kind : kinds) EXPECT_EQ(partition_kind(name_of(kind)), kind);
}

}  // namespace
}  // namespace talus
