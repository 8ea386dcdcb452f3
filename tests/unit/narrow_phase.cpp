#include "kernels/narrow_phase.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <numeric>

#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::Random;
using test::Sample;
using test::uniform;

NarrowPhase narrow_phase(const Sample& sample, double alert = 0.05) {
  return {sample.bodies.x,  sample.bodies.radius, sample.bodies.velocity, sample.walls, 1e-3, alert, 0,
          Vec3(0, 0, -9.81)};
}

void find(const NarrowPhase& in, const SweepKernels& kernels, Sample& sample) {
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    narrow_chunk(in, sample.candidates, sample.chunks, c, kernels, sample.contacts);
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
  for (std::size_t k = range.begin; k < range.end; ++k) {
    ASSERT_EQ(y.first_record[k], record_of(y.first[k]));
    if (y.second[k] >= 0) {
      ASSERT_EQ(y.second_record[k], record_of(y.second[k]));
    }
  }
  for (std::size_t k = range.begin, g = range.begin; k < range.end; k += x.group[g++])
    ASSERT_EQ(x.group[g], y.group[g]);
}

void expect_scalar_contacts(const Sample& sample, const NarrowPhase& in) {
  Sample expected = sample;
  find(in, SweepKernels(InstructionSet::portable), expected);
  for (const InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
    if (set > best_instruction_set()) continue;
    SCOPED_TRACE(name_of(set));
    Sample found = sample;
    find(in, SweepKernels(set), found);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) expect_same_contacts(found, expected, c);
  }
}

Sample fresh_sample(bool friction, int target, std::uint64_t seed) {
  Sample sample = test::dense_sample(6, seed, friction, true, target);
  Random random(seed);
  for (double& r : sample.candidates.impulse) r = uniform(random, -1, 1);
  allocate(sample.contacts, sample.candidates, sample.chunks, friction);
  return sample;
}

// Chunks from one pair to many groups, and every length behind the last full vector.
TEST(NarrowPhase, FindsTheSameBitsOnEveryInstructionSet) {
  for (int target : {1, 5, 7, 16, 37, 100, 384})
    for (const bool friction : {false, true}) {
      SCOPED_TRACE(testing::Message() << "chunks of " << target);
      const Sample sample = fresh_sample(friction, target, 3);
      NarrowPhase in = narrow_phase(sample);
      expect_scalar_contacts(sample, in);
      in.overlap_correction = 0.3;
      in.restitution = 0.6;
      expect_scalar_contacts(sample, in);
    }
}

TEST(NarrowPhase, FindsTheSameBitsOfPairsThatPassCoincideOrAreNoNumbers) {
  Sample sample = fresh_sample(true, 50, 5);
  for (std::size_t s = 0; s < sample.bodies.size(); s += 7)
    for (double& u : sample.bodies.velocity[s].u) u *= 2000;
  sample.bodies.x[1] = sample.bodies.x[static_cast<std::size_t>(sample.candidates.grain_pairs[0].second)];
  sample.bodies.x[40][1] = std::numeric_limits<double>::quiet_NaN();
  sample.bodies.velocity[90].u[2] = std::numeric_limits<double>::infinity();
  const NarrowPhase in = narrow_phase(sample);
  expect_scalar_contacts(sample, in);
  find(in, SweepKernels(InstructionSet::portable), sample);
  EXPECT_GT(std::accumulate(sample.contacts.passed.begin(), sample.contacts.passed.end(), 0), 0);
}

// What a step finds must not depend on the step in which the candidates were found: a run that goes on from a
// saved state has not seen those before it.
TEST(NarrowPhase, KeepsGroupsThatAreThoseOfAFreshStart) {
  for (const bool friction : {false, true}) {
    Sample sample = fresh_sample(friction, 40, 8);
    const SweepKernels kernels(best_instruction_set());
    Random random(1);
    int changed = 0, kept = 0;
    for (int step = 0; step < 30; ++step) {
      // Every third step moves few grains, so that some chunks keep their contacts.
      const double part = step % 3 == 0 ? 0.02 : 0.3;
      for (Vec3& x : sample.bodies.x)
        if (uniform(random, 0, 1) < part) x += test::uniform_vector(random, -0.005, 0.005);
      for (double& r : sample.candidates.impulse) r = uniform(random, -1, 1);
      const std::vector<std::int32_t> before = sample.contacts.candidate;
      find(narrow_phase(sample), kernels, sample);
      Sample fresh = sample;
      allocate(fresh.contacts, fresh.candidates, fresh.chunks, friction);
      find(narrow_phase(fresh), kernels, fresh);
      for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
        expect_same_contacts(sample, fresh, c);
        if (sample.chunks.wall[c] >= 0) continue;
        const auto from = before.begin() + sample.chunks.begin[c],
                   to = before.begin() + sample.chunks.begin[c + 1];
        ++(std::equal(from, to, sample.contacts.candidate.begin() + sample.chunks.begin[c]) ? kept : changed);
      }
    }
    EXPECT_GT(kept, 20);
    EXPECT_GT(changed, 20);
  }
}

}  // namespace
}  // namespace talus
