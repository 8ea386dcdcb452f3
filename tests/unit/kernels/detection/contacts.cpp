#include "kernels/detection/narrow_phase.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "tests/unit/dense_sample.hpp"
#include "tests/unit/kernels/detection/contact_groups.hpp"

namespace talus {
namespace {

using test::Random;
using test::Sample;
using test::uniform;

void set_random_impulses(Candidates& candidates, std::uint64_t seed) {
  Random random(seed);
  for (double& r : candidates.impulse.values()) r = uniform(random, -1, 1);
}

// In the same 32 bits a body up to the last that a process may have, and any feature of a wall.
TEST(ContactBody, IsASlotOrAFeatureOfAWall) {
  constexpr Slot last = static_cast<Slot>(most_bodies_of_a_process - 1),
                 least = std::numeric_limits<Slot>::min();
  for (const Slot slot : {0, 1, 7, 8, 1000003, last, -1, -2, -7, -8, -9, -100000007, least + 1, least}) {
    const ContactBody body = slot;
    EXPECT_EQ(Slot{body}, slot);
    if (slot < 0) continue;
    EXPECT_EQ(*record_places(&body), 8 * std::uint64_t(slot));
  }
}

TEST(Contacts, AreTheCandidatesNearerThanTheAlertDistance) {
  constexpr double alert = 0.04;
  Sample sample = test::dense_sample(7, 2, true, true, 100);
  for (Velocity& v : sample.bodies.velocity) std::fill_n(v.u, 3, 0.0);
  test::find_contacts(sample, alert);
  std::multiset<std::int32_t> found, expected;
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k)
      found.insert(sample.contacts.candidate[k]);
  const std::vector<GrainPair>& grain_pairs = sample.candidates.grain_pairs;
  const std::vector<WallPair>& wall_pairs = sample.candidates.wall_pairs;
  for (std::size_t k = 0; k < sample.candidates.size(); ++k) {
    double gap;
    if (k < grain_pairs.size()) {
      const auto i = static_cast<std::size_t>(grain_pairs[k].first),
                 j = static_cast<std::size_t>(grain_pairs[k].second);
      gap = (sample.bodies.x[i] - sample.bodies.x[j]).norm() - sample.bodies.radius[i] -
            sample.bodies.radius[j];
    } else {
      const WallPair& pair = wall_pairs[k - grain_pairs.size()];
      const auto i = static_cast<std::size_t>(pair.body);
      const Wall& wall = sample.walls[static_cast<std::size_t>(pair.wall)];
      gap = wall.normal.dot(sample.bodies.x[i] - wall.point) - sample.bodies.radius[i];
    }
    if (gap < alert) expected.insert(static_cast<std::int32_t>(k));
  }
  EXPECT_GT(expected.size(), 500u);
  EXPECT_LT(expected.size(), sample.candidates.size());
  EXPECT_EQ(found, expected);
}

// Also where chunks are shorter than a group, and where a large grain is in every contact.
TEST(Contacts, StandInGroupsWithoutACommonGrain) {
  for (int target : {1, 7, 48, 384, 1000}) {
    const Sample sample = test::dense_sample(9, 3, true, true, target);
    std::size_t full = 0, all = 0;
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      for (const std::size_t size : test::checked_groups(sample, c)) {
        full += size == 16 ? 16 : 0;
        all += size;
      }
    if (target >= 384) {
      EXPECT_GE(full, 85 * all / 100);
    }
  }
}

// 150 small grains on a large one share it in every pair: there is no batch of two, and more than 64 batches
// of one.
TEST(Contacts, OfOneLargeGrainAreAllKeptThoughNoBatchFits) {
  Sample sample;
  add_sphere(sample.bodies, BodyId{0}, Vec3::Zero(), 10, 1000);
  Random random(4);
  for (int k = 1; k <= 150; ++k) {
    const Vec3 direction = test::uniform_vector(random, -1, 1).normalized();
    add_sphere(sample.bodies, BodyId{k}, 10.01 * direction, 0.01, 1000);
    sample.candidates.grain_pairs.push_back({0, static_cast<Slot>(k)});
  }
  sample.candidates.impulse.assign_zeros(sample.candidates.size());
  sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 384);
  test::find_contacts(sample, 0.001);
  ASSERT_EQ(sample.chunks.size(), 1u);
  ASSERT_EQ(sample.contacts.count[0], 150);
  std::set<std::int32_t> kept(sample.contacts.candidate.begin(), sample.contacts.candidate.end());
  EXPECT_EQ(kept.size(), 150u);
}

TEST(Contacts, PointFromTheSecondBodyToTheFirst) {
  const Sample sample = test::dense_sample(5, 3, true, true, 50);
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k) {
      const Contacts& contacts = sample.contacts;
      const Vec3 n(contacts.nx[k], contacts.ny[k], contacts.nz[k]);
      EXPECT_NEAR(n.norm(), 1, 1e-15);
      const auto i = static_cast<std::size_t>(contacts.first[k]);
      if (contacts.second[k] < 0) {
        EXPECT_EQ(n, sample.walls[static_cast<std::size_t>(sample.chunks.wall[c])].normal);
        continue;
      }
      const Vec3 d = sample.bodies.x[i] - sample.bodies.x[static_cast<std::size_t>(contacts.second[k])];
      EXPECT_NEAR(n.dot(d), d.norm(), 1e-14);
    }
}

TEST(Contacts, OfCoincidentCentresPointUp) {
  Sample sample;
  for (int k = 0; k < 2; ++k) add_sphere(sample.bodies, BodyId{k}, Vec3(1, 2, 3), 0.5, 1000);
  sample.candidates.grain_pairs = {{0, 1}};
  sample.candidates.impulse.assign_zeros(1);
  sample.chunks = cut_chunks(sample.candidates, 2, 10);
  test::find_contacts(sample, 0.01);
  ASSERT_EQ(sample.contacts.count[0], 1);
  EXPECT_EQ(sample.contacts.nx[0], 0);
  EXPECT_EQ(sample.contacts.ny[0], 0);
  EXPECT_EQ(sample.contacts.nz[0], 1);
  EXPECT_EQ(sample.contacts.bias[0], 0);
}

TEST(Contacts, WithoutFrictionHaveOneImpulseComponentAndNoRoomForMore) {
  for (bool friction : {false, true}) {
    Sample sample =
        test::dense_sample(4, 1, !friction, false, 100);  // first the other kind: room is given back
    sample.candidates = test::find_candidates(sample.bodies, sample.walls, 0.1, friction);
    test::find_contacts(sample, 0.1);
    const std::size_t n = sample.candidates.size();
    for (const auto* values : {&sample.contacts.rx, &sample.contacts.ry, &sample.contacts.rz}) {
      EXPECT_EQ(values->size(), friction ? n : 0);
      EXPECT_EQ(values->capacity() > 0, friction);
    }
    EXPECT_EQ(sample.contacts.rn.size(), friction ? 0 : n);
    EXPECT_EQ(sample.contacts.rn.capacity() > 0, !friction);
  }
}

TEST(WarmStart, ComesBackUnchangedFromTheContacts) {
  for (bool friction : {false, true}) {
    Sample sample = test::dense_sample(6, 9, friction, true, 60);
    set_random_impulses(sample.candidates, 5);
    test::find_contacts(sample, 0.03);
    const KeptImpulses before = sample.candidates.impulse;
    std::set<std::int32_t> contacts;
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
      for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k)
        contacts.insert(sample.contacts.candidate[k]);
      store_impulses(sample.contacts, sample.chunks, c, sample.candidates);
    }
    EXPECT_LT(contacts.size(), sample.candidates.size());
    for (std::size_t k = 0; k < before.size(); ++k) {
      const bool contact = contacts.count(static_cast<std::int32_t>(k)) > 0;
      for (std::size_t c = 0; c < before.row(k).size(); ++c)
        EXPECT_EQ(sample.candidates.impulse.row(k)[c], contact ? before.row(k)[c] : 0.0);
    }
  }
}

/// Two unit spheres, or one and the wall z = 0, with a gap and a relative normal velocity v_n < 0 closing.
struct Approach {
  double gap;  // [m]
  double v_n;  // [m/s]
  double restitution;
  double gravity = 0;  // downwards [m/s^2]
  double gain = 0;     // upwards, what a load adds to the wall within the step [m/s]
};
constexpr double h = 0.01, alert = 0.05;

/// Bias of the contact, or NaN when there is none.
double bias_of(const Approach& approach, bool at_wall) {
  Sample sample;
  add_sphere(sample.bodies, BodyId{0}, Vec3(0, 0, 1 + approach.gap), 1, 1000);
  sample.bodies.velocity[0].u[2] = approach.v_n;
  if (at_wall) {
    sample.walls.resize(1);
    sample.walls[0].gain = {0, 0, approach.gain};
    sample.candidates.wall_pairs = {{0, 0}};
  } else {
    add_sphere(sample.bodies, BodyId{1}, Vec3(0, 0, -1), 1, 1000);
    sample.candidates.grain_pairs = {{0, 1}};
  }
  sample.candidates.impulse = KeptImpulses(ImpulseKind::normal);
  sample.candidates.impulse.assign_zeros(1);
  sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 10);
  allocate(sample.contacts, sample.candidates, sample.chunks, false);
  const NarrowPhase in{sample.bodies.x,
                       sample.bodies.radius,
                       sample.bodies.velocity,
                       sample.walls,
                       h,
                       alert,
                       PairTable(2, {0, approach.restitution}),
                       Vec3(0, 0, -approach.gravity)};
  narrow_chunk(in, sample.candidates, sample.chunks, 0, InstructionSet::portable, sample.contacts);
  return sample.contacts.count[0] > 0 ? sample.contacts.bias[0] : std::nan("");
}

TEST(GapTerm, IsGapOverStepAndZeroOnceClosed) {
  for (bool wall : {false, true}) {
    EXPECT_NEAR(bias_of({0.02, 0, 0}, wall), 0.02 / h, 1e-12);
    EXPECT_NEAR(bias_of({0.02, -50, 0}, wall), 0.02 / h, 1e-12);
    EXPECT_EQ(bias_of({-0.02, 0, 0}, wall), 0);
    EXPECT_EQ(bias_of({-0.02, -50, 0}, wall), 0);
  }
}

TEST(GapTerm, ExistsBeyondTheAlertDistanceOnlyWhenTheGapClosesWithinTheStep) {
  for (bool wall : {false, true}) {
    EXPECT_TRUE(std::isnan(bias_of({0.06, 0, 0}, wall)));
    EXPECT_TRUE(std::isnan(bias_of({0.06, 10, 0}, wall)));
    EXPECT_TRUE(std::isnan(bias_of({0.06, -5.9, 0}, wall)));
    EXPECT_NEAR(bias_of({0.06, -6.1, 0}, wall), 0.06 / h, 1e-12);
  }
}

TEST(GapTerm, AtAWallCountsWhatGravityAddsToTheApproach) {
  EXPECT_TRUE(std::isnan(bias_of({0.06, -5.9, 0, 9}, false))) << "both grains fall alike";
  EXPECT_NEAR(bias_of({0.06, -5.92, 0, 9}, true), 0.06 / h, 1e-12);
}

TEST(GapTerm, AtAPushedWallCountsWhatItsLoadAddsToTheApproach) {
  EXPECT_TRUE(std::isnan(bias_of({0.06, -5.9, 0, 0, -0.2}, true))) << "it is drawn back";
  EXPECT_NEAR(bias_of({0.06, -5.9, 0, 0, 0.2}, true), 0.06 / h, 1e-12);
}

TEST(Restitution, ActsOnFastPairsThatMeetWithinTheStep) {
  for (bool wall : {false, true}) {
    EXPECT_DOUBLE_EQ(bias_of({0.02, -3, 0.5}, wall), -1.5);
    EXPECT_NEAR(bias_of({0.02, -1.5, 0.5}, wall), 0.02 / h, 1e-12) << "others may push it together";
    EXPECT_TRUE(std::isnan(bias_of({0.02, -1.5, 1}, wall))) << "which would cost an elastic pair energy";
    EXPECT_DOUBLE_EQ(bias_of({-0.02, -3, 0.5}, wall), -1.5);
    EXPECT_DOUBLE_EQ(bias_of({-0.02, -3, 1}, wall), -3);
    EXPECT_DOUBLE_EQ(bias_of({-0.02, 3, 0.5}, wall), 1.5) << "separating pairs follow the same law";
    EXPECT_NEAR(bias_of({0.02, 3, 0.5}, wall), 0.02 / h, 1e-12);
    EXPECT_TRUE(std::isnan(bias_of({0.02, 3, 1}, wall)));
  }
}

TEST(Restitution, LeavesSlowApproachesAtRest) {
  const double g = 10, slow = 2 * h * g;
  for (bool wall : {false, true}) {
    EXPECT_EQ(bias_of({-0.001, -0.99 * slow, 0.8, g}, wall), 0);
    EXPECT_NEAR(bias_of({0.001, -0.99 * slow, 0.8, g}, wall), 0.001 / h, 1e-12);
    EXPECT_DOUBLE_EQ(bias_of({-0.001, -1.01 * slow, 0.8, g}, wall), -0.8 * 1.01 * slow)
        << "e acts on the velocity at the beginning of the step, without the fall within it";
  }
}

}  // namespace
}  // namespace talus
