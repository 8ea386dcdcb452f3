#include "kernels/detection/narrow_phase.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>

#include "tests/unit/dense_sample.hpp"
#include "tests/unit/kernels/detection/contact_groups.hpp"

namespace talus {
namespace {

using test::Random;
using test::Sample;
using test::uniform;

NarrowPhase narrow_phase(const Sample& sample, double alert = 0.05) {
  return {sample.bodies.x,  sample.bodies.radius, sample.bodies.velocity, sample.walls, 1e-3, alert, {},
          Vec3(0, 0, -9.81)};
}

void find(const NarrowPhase& in, InstructionSet set, Sample& sample) {
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    narrow_chunk(in, sample.candidates, sample.chunks, c, set, sample.contacts);
}

/// All that a sweep sees of one chunk: exact bits, NaN and the sign of zero included.
void expect_same_contacts(const Sample& a, const Sample& b, std::size_t chunk) {
  SCOPED_TRACE(testing::Message() << "chunk " << chunk);
  ASSERT_EQ(a.contacts.count[chunk], b.contacts.count[chunk]);
  EXPECT_EQ(a.contacts.passed[chunk], b.contacts.passed[chunk]);
  const ContactRange range = a.range(chunk);
  const auto same = [&](const auto& x, const auto& y) {
    if (x.empty() || range.begin == range.end) return x.size() == y.size();
    return std::memcmp(&x[range.begin], &y[range.begin], (range.end - range.begin) * sizeof(x[0])) == 0;
  };
  const Contacts &x = a.contacts, &y = b.contacts;
  EXPECT_TRUE(same(x.candidate, y.candidate));
  EXPECT_TRUE(same(x.first, y.first) && same(x.second, y.second));
  EXPECT_TRUE(same(x.nx, y.nx) && same(x.ny, y.ny) && same(x.nz, y.nz) && same(x.bias, y.bias));
  EXPECT_TRUE(same(x.rx, y.rx) && same(x.ry, y.ry) && same(x.rz, y.rz) && same(x.rn, y.rn));
  for (std::size_t k = range.begin, g = range.begin; k < range.end; k += x.group[g++])
    ASSERT_EQ(x.group[g], y.group[g]);
}

void expect_scalar_contacts(const Sample& sample, const NarrowPhase& in) {
  Sample expected = sample;
  find(in, InstructionSet::portable, expected);
  for (const InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
    if (set > best_instruction_set()) continue;
    SCOPED_TRACE(name_of(set));
    Sample found = sample;
    find(in, set, found);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) expect_same_contacts(found, expected, c);
  }
}

Sample fresh_sample(bool friction, int target, std::uint64_t seed) {
  Sample sample = test::dense_sample(6, seed, friction, true, target);
  Random random(seed);
  for (double& r : sample.candidates.impulse.values()) r = uniform(random, -1, 1);
  allocate(sample.contacts, sample.candidates, sample.chunks, friction);
  return sample;
}

// Chunks from one pair to many groups, and every length behind the last full vector.
TEST(NarrowPhase, FindsTheSameBitsOnEveryInstructionSet) {
  if (best_instruction_set() == InstructionSet::portable) GTEST_SKIP() << test::no_other_instruction_set;
  for (int target : {1, 5, 7, 16, 37, 100, 384})
    for (const bool friction : {false, true}) {
      SCOPED_TRACE(testing::Message() << "chunks of " << target);
      const Sample sample = fresh_sample(friction, target, 3);
      NarrowPhase in = narrow_phase(sample);
      expect_scalar_contacts(sample, in);
      in.reflection = 0.6;
      in.laws.set_all(&PairLaw::restitution, 0.6);
      expect_scalar_contacts(sample, in);
    }
}

TEST(NarrowPhase, FindsTheSameBitsOfPairsThatPassCoincideOrAreNoNumbers) {
  if (best_instruction_set() == InstructionSet::portable) GTEST_SKIP() << test::no_other_instruction_set;
  Sample sample = fresh_sample(true, 50, 5);
  for (std::size_t s = 0; s < sample.bodies.size(); s += 7)
    for (double& u : sample.bodies.velocity[s].u) u *= 2000;
  sample.bodies.x[1] = sample.bodies.x[static_cast<std::size_t>(sample.candidates.grain_pairs[0].second)];
  sample.bodies.x[40][1] = std::numeric_limits<double>::quiet_NaN();
  sample.bodies.velocity[90].u[2] = std::numeric_limits<double>::infinity();
  const NarrowPhase in = narrow_phase(sample);
  expect_scalar_contacts(sample, in);
  find(in, InstructionSet::portable, sample);
  EXPECT_GT(std::accumulate(sample.contacts.passed.begin(), sample.contacts.passed.end(), 0), 0);
}

/// By candidate: normal, bias, impulse.
using Found = std::map<std::int32_t, std::array<double, 7>>;
Found contacts_of(const Sample& sample, std::size_t chunk) {
  const Contacts& c = sample.contacts;
  Found found;
  for (std::size_t k = sample.range(chunk).begin; k < sample.range(chunk).end; ++k) {
    std::array<double, 7> values = {c.nx[k], c.ny[k], c.nz[k], c.bias[k]};
    if (c.rn.empty())
      values[4] = c.rx[k], values[5] = c.ry[k], values[6] = c.rz[k];
    else
      values[4] = c.rn[k];
    found[c.candidate[k]] = values;
  }
  return found;
}

std::size_t stayed(const Sample& sample, std::size_t chunk, const std::vector<std::int32_t>& before) {
  std::size_t count = 0;
  for (std::size_t k = sample.range(chunk).begin; k < sample.range(chunk).end; ++k)
    count += sample.contacts.candidate[k] == before[k];
  return count;
}

// A step finds the contacts that a fresh start finds; where only some came or went, the others stay where
// they are, in groups that are as full as freshly dealt ones.
TEST(NarrowPhase, RepairsTheGroupsOfFewContactsThatCameOrWent) {
  for (const bool friction : {false, true}) {
    Sample sample = fresh_sample(friction, 300, 8);
    const InstructionSet best = best_instruction_set();
    find(narrow_phase(sample), best, sample);
    Sample other = sample;
    Random random(1);
    std::size_t kept = 0, repaired = 0, dealt = 0, groups = 0, fresh_groups = 0;
    for (int step = 0; step < 200; ++step) {
      // Every sixth step moves many grains, and far.
      const double part = step % 6 == 0 ? 0.5 : 0.02, way = step % 6 == 0 ? 0.05 : 0.01;
      for (Vec3& x : sample.bodies.x)
        if (uniform(random, 0, 1) < part) x += test::uniform_vector(random, -way, way);
      for (double& r : sample.candidates.impulse.values()) r = uniform(random, -1, 1);
      other.bodies.x = sample.bodies.x;
      other.candidates.impulse = sample.candidates.impulse;
      const Contacts before = sample.contacts;
      find(narrow_phase(sample), best, sample);
      find(narrow_phase(other), InstructionSet::portable, other);
      Sample fresh = sample;
      allocate(fresh.contacts, fresh.candidates, fresh.chunks, friction);
      find(narrow_phase(fresh), best, fresh);
      for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
        EXPECT_EQ(contacts_of(sample, c), contacts_of(fresh, c));
        expect_same_contacts(sample, other, c);
        if (sample.chunks.wall[c] >= 0) continue;
        groups += test::checked_groups(sample, c).size();
        fresh_groups += test::checked_groups(fresh, c).size();
        const auto was = static_cast<std::size_t>(before.count[c]),
                   is = static_cast<std::size_t>(sample.contacts.count[c]);
        const std::size_t same = stayed(sample, c, before.candidate);
        ++(same == was && same == is ? kept : 4 * same > 3 * is ? repaired : dealt);
      }
    }
    EXPECT_GT(kept, 20u);
    EXPECT_GT(repaired, 20u);
    EXPECT_GT(dealt, 20u);
    EXPECT_LE(groups, fresh_groups + fresh_groups / 50);
  }
}

// 150 small grains on a large one: each contact is a group of its own, and leaves none behind.
TEST(NarrowPhase, RepairsGroupsOfOne) {
  Sample sample;
  add_sphere(sample.bodies, BodyId{0}, Vec3::Zero(), 10, 1000);
  for (int k = 1; k <= 150; ++k) {
    const double turn = 0.04 * k;
    add_sphere(sample.bodies, BodyId{k}, 10.01 * Vec3(std::cos(turn), std::sin(turn), 0), 0.01, 1000);
    sample.candidates.grain_pairs.push_back({0, static_cast<Slot>(k)});
  }
  sample.candidates.impulse.assign_zeros(sample.candidates.size());
  sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 384);
  test::find_contacts(sample, 0.001);
  const InstructionSet best = best_instruction_set();
  for (const std::size_t away : {1u, 70u, 150u}) {
    sample.bodies.x[away] *= 1.1;
    find(narrow_phase(sample, 0.001), best, sample);
    EXPECT_EQ(test::checked_groups(sample, 0).size(), 149u);
    sample.bodies.x[away] /= 1.1;
    find(narrow_phase(sample, 0.001), best, sample);
    EXPECT_EQ(test::checked_groups(sample, 0).size(), 150u);
    EXPECT_EQ(contacts_of(sample, 0).size(), 150u);
  }
}

// The last contact goes, the first one comes.
TEST(NarrowPhase, FindsContactsInAChunkThatHadNone) {
  Sample sample = fresh_sample(true, 300, 8);
  for (Velocity& v : sample.bodies.velocity) std::fill_n(v.u, 3, 0.0);
  const std::vector<Vec3> near = sample.bodies.x;
  const InstructionSet best = best_instruction_set();
  std::vector<std::int32_t> counts;
  for (const double apart : {1.0, 2.0, 1.0}) {
    for (std::size_t s = 0; s < near.size(); ++s) sample.bodies.x[s] = apart * near[s];
    find(narrow_phase(sample), best, sample);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) test::checked_groups(sample, c);
    counts.push_back(sample.contacts.count.front());
  }
  EXPECT_GT(counts[0], 100);
  EXPECT_EQ(counts[1], 0);
  EXPECT_EQ(counts[2], counts[0]);
}

}  // namespace
}  // namespace talus
