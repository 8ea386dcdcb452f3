/// A periodic cell against a search over all images.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/detection/images.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::pairs_by_brute_force;
using test::Random;
using test::uniform;
using test::uniform_vector;

/// A cell as the tests know it: three edges as columns; 0 along an axis that does not repeat.
struct Edges {
  const char* name;
  Vec3 lengths, shears, low;
  Mat3 columns() const {
    Mat3 h = Mat3(lengths.asDiagonal());
    h(0, 1) = shears[0];
    h(0, 2) = shears[1];
    h(1, 2) = shears[2];
    return h;
  }
  Domain domain() const { return periodic_domain(lengths, low, shears); }
};
const Edges cells[] = {
    {"cube", {9, 9, 9}, {0, 0, 0}, {0, 0, 0}},
    {"brick", {7, 9, 11}, {0, 0, 0}, {-3, 40, 0.5}},
    {"along x", {8, 0, 0}, {0, 0, 0}, {1, 0, 0}},
    {"along x and z", {8, 0, 9}, {0, 0, 0}, {0, 0, -20}},
    {"sheared", {9, 9, 9}, {0, 3.1, 0}, {0, 0, 0}},
    {"sheared beyond half an edge", {8, 9, 10}, {-5.2, 7.3, 4.4}, {2, -1, 0}},
};

/// The shortest of the differences between images, looked for among 7^3 of them.
Vec3 shortest(const Edges& cell, const Vec3& a, const Vec3& b) {
  const Mat3 h = cell.columns();
  Vec3 best = Vec3::Constant(std::numeric_limits<double>::infinity());
  for (int x = -3; x <= 3; ++x)
    for (int y = -3; y <= 3; ++y)
      for (int z = -3; z <= 3; ++z)
        if (const Vec3 d = a - b + h * Vec3(x, y, z); d.norm() < best.norm()) best = d;
  return best;
}

/// Somewhere in the brick, and along other axes in [0, 9].
Vec3 place_in(const Edges& cell, Random& random) {
  const Vec3 share = uniform_vector(random, 0, 1);
  return cell.low + Vec3((cell.lengths.array() > 0).select(cell.lengths, 9)).cwiseProduct(share);
}

TEST(PeriodicCell, SeparationIsThatOfTheNearestImagesWithinHalfAnEdge) {
  Random random(1);
  for (const Edges& cell : cells) {
    const Domain domain = cell.domain();
    const double half = 0.5 * (cell.lengths.array() > 0).select(cell.lengths, 1e9).minCoeff();
    int compared = 0;
    for (int k = 0; k < 4000; ++k) {
      const Vec3 a = place_in(cell, random), b = place_in(cell, random), expected = shortest(cell, a, b);
      if (expected.norm() >= half) continue;
      ++compared;
      EXPECT_LT((domain.separation(a, b) - expected).norm(), 1e-13) << cell.name;
      EXPECT_EQ(domain.separation(b, a), -domain.separation(a, b)) << cell.name;
    }
    EXPECT_GT(compared, 100) << cell.name;
  }
}

TEST(PeriodicCell, WrappedPointsAreImagesInTheBrick) {
  Random random(2);
  for (const Edges& cell : cells) {
    const Domain domain = cell.domain();
    const Mat3 h = cell.columns();
    for (int k = 0; k < 300; ++k) {
      const Vec3 inside = place_in(cell, random);
      Vec3 turns;
      for (double& turn : turns) turn = std::round(uniform(random, -4, 4));
      const Vec3 wrapped = domain.wrap(inside + h * turns);
      EXPECT_LT((wrapped - inside).norm(), 1e-12) << cell.name;
    }
  }
}

TEST(PeriodicCell, MidpointIsTheSameBitsFromBothSidesAndHalfwayToBoth) {
  Random random(3);
  for (const Edges& cell : cells) {
    const Domain domain = cell.domain();
    const double half = 0.5 * (cell.lengths.array() > 0).select(cell.lengths, 1e9).minCoeff();
    for (int k = 0; k < 2000; ++k) {
      const Vec3 a = place_in(cell, random), b = place_in(cell, random), d = domain.separation(a, b);
      if (d.norm() >= half) continue;
      const Vec3 middle = domain.midpoint(a, b);
      EXPECT_EQ(middle, domain.midpoint(b, a)) << cell.name;
      EXPECT_LT((domain.separation(a, middle) - 0.5 * d).norm(), 1e-13) << cell.name;
      EXPECT_LT((domain.wrap(middle) - middle).norm(), 1e-12) << cell.name;
    }
  }
}

/// Every pair with images nearer than the sum of their reaches, by looking at all of them.
std::vector<GrainPair> pairs_among_images(const Edges& cell, std::span<const Vec3> x,
                                          std::span<const double> reach) {
  std::vector<GrainPair> pairs;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = i + 1; j < x.size(); ++j)
      if (shortest(cell, x[i], x[j]).norm() < reach[i] + reach[j])
        pairs.push_back({static_cast<Slot>(i), static_cast<Slot>(j)});
  return pairs;
}

TEST(PeriodicCell, CandidatesAreThoseOfASearchOverAllImages) {
  Random random(4);
  for (const Edges& cell : cells) {
    std::vector<Vec3> x;
    std::vector<double> reach;
    for (int k = 0; k < 160; ++k) {
      x.push_back(place_in(cell, random));
      reach.push_back(k % 20 == 0 ? uniform(random, 0.8, 1.2) : uniform(random, 0.1, 0.5));
    }
    const std::vector<GrainPair> expected = pairs_among_images(cell, x, reach);
    EXPECT_GT(expected.size(), pairs_by_brute_force(x, reach).size()) << "some across faces, " << cell.name;
    EXPECT_TRUE(near_pairs(cell.domain(), x, reach) == expected) << cell.name;
  }
}

TEST(PeriodicCell, BodiesOfAnyReachComeOnceInEachPair) {
  // Fast grains reach farther than half the cell, some farther than all of it.
  const Edges cell = cells[5];
  Random random(5);
  std::vector<Vec3> x;
  for (int k = 0; k < 30; ++k) x.push_back(place_in(cell, random));
  for (const double reach : {3.0, 30.0, 1e9}) {
    const std::vector<GrainPair> pairs = near_pairs(cell.domain(), x, std::vector<double>(x.size(), reach));
    EXPECT_TRUE(std::ranges::is_sorted(pairs, [](const GrainPair& a, const GrainPair& b) {
      return std::pair(a.first, a.second) <= std::pair(b.first, b.second);
    }));
    for (const GrainPair& pair : pairs) EXPECT_LT(pair.first, pair.second);
    EXPECT_TRUE(reach < 30 || pairs.size() == 30 * 29 / 2);
  }
}

/// What pairs that pass one another in a step have in place of their gap: by places looked for on the way.
double gap_of_way(const Vec3& d, const Vec3& way, double touching) {
  const double far = d.norm(), gap = far - touching, along = d.dot(way) / far;
  if (gap <= 0 || gap + along >= 0 || (way - along / far * d).norm() <= 1e-3 * far) return gap;
  double nearest = far;
  for (int part = 1; part <= 4000; ++part) nearest = std::min(nearest, (d + part / 4000.0 * way).norm());
  return nearest > touching ? nearest - touching - along : gap;
}

/// Gap, normal and bias of every contact against the shortest way between images, with every instruction set,
/// in steps in which grains hardly move and in such in which they pass one another.
TEST(PeriodicCell, ContactsAreThoseOfTheNearestImages) {
  for (const double h : {1e-5, 0.2})
    for (const Edges& cell : {Edges{"cube", {6, 6, 6}, {0, 0, 0}, {0, 0, 0}},
                              Edges{"sheared", {6, 6, 6}, {0, 2.5, 1}, {0, 0, 0}}}) {
      std::size_t passing = 0;
      for (const InstructionSet set : test::sets_to_test()) {
        test::Sample sample;
        sample.bodies = test::jittered_lattice(6, 7);
        std::vector<double> reach = sample.bodies.radius;
        for (double& r : reach) r += 0.05;
        sample.candidates.impulse = KeptImpulses(ImpulseKind::force);
        sample.candidates.grain_pairs = near_pairs(cell.domain(), sample.bodies.x, reach);
        sample.candidates.impulse.assign_zeros(sample.candidates.size());
        sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 64);
        allocate(sample.contacts, sample.candidates, sample.chunks, true);
        NarrowPhase in{
            sample.bodies.x, sample.bodies.radius, sample.bodies.velocity, sample.walls, h, 0.1, {},
            Vec3::Zero()};
        in.domain = cell.domain();
        std::size_t found = 0, across = 0;
        for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
          narrow_chunk(in, sample.candidates, sample.chunks, c, set, sample.contacts);
          const ContactRange range = sample.range(c);
          for (std::size_t k = range.begin; k < range.end; ++k) {
            const auto i = static_cast<std::size_t>(sample.contacts.first[k]),
                       j = static_cast<std::size_t>(sample.contacts.second[k]);
            const Vec3 d = shortest(cell, sample.bodies.x[i], sample.bodies.x[j]);
            const Vec3 n(sample.contacts.nx[k], sample.contacts.ny[k], sample.contacts.nz[k]);
            EXPECT_LT((n - d.normalized()).norm(), 1e-12);
            using Map = Eigen::Map<const Vec3>;
            const Vec3 way = h * (Map(sample.bodies.velocity[i].u) - Map(sample.bodies.velocity[j].u));
            const double touching = sample.bodies.radius[i] + sample.bodies.radius[j],
                         gap = gap_of_way(d, way, touching);
            EXPECT_NEAR(h * sample.contacts.bias[k], std::max(gap, 0.0), h > 0.1 ? 1e-6 : 1e-13);
            passing += gap != d.norm() - touching ? 1 : 0;
            across += (d - (sample.bodies.x[i] - sample.bodies.x[j])).norm() > 1;
          }
          found += range.end - range.begin;
        }
        std::size_t expected = 0;
        for (std::size_t i = 0; i < sample.bodies.size(); ++i)
          for (std::size_t j = i + 1; j < sample.bodies.size(); ++j)
            expected += shortest(cell, sample.bodies.x[i], sample.bodies.x[j]).norm() <
                        sample.bodies.radius[i] + sample.bodies.radius[j] + 0.1;
        EXPECT_GE(found, expected * 9 / 10) << "candidates reach 0.1 m, as the alert distance does";
        EXPECT_GT(across, 30u) << cell.name;
      }
      EXPECT_EQ(passing > 10, h > 0.1) << passing;
    }
}

TEST(PeriodicCell, VolumeAndLengthsAreThoseOfTheCellAndTheWallsBesideIt) {
  std::vector<Wall> walls = test::box_of_walls(0, 5);
  walls.erase(walls.begin(), walls.begin() + 4);
  const Domain domain = periodic_domain({2, 3, 0});
  EXPECT_EQ(domain.lengths(walls), Vec3(2, 3, 5));
  EXPECT_EQ(domain.volume(walls), 30);
  EXPECT_EQ(domain.volume({}), 0) << "nothing bounds it along z";
  EXPECT_EQ(face_area(walls, 1, domain.edges()), 6);
  EXPECT_EQ(periodic_domain({2, 3, 4}, Vec3::Zero(), {0, 1, 0}).volume({}), 24) << "shear keeps the volume";
}

TEST(PeriodicCell, EdgesThatMakeNoSenseAreRefused) {
  EXPECT_THROW(periodic_domain({0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(periodic_domain({1, -1, 0}), std::invalid_argument);
  EXPECT_THROW(periodic_domain({1, 1, std::nan("")}), std::invalid_argument);
  EXPECT_THROW(periodic_domain({1, 1, 0}, Vec3::Zero(), {0, 0.5, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace talus
