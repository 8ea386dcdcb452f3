#include "kernels/sweeps/sweep_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

using test::Random;
using test::Sample;
using test::uniform;

/// Exact bits, NaN and the sign of zero included.
bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), 8 * a.size()) == 0);
}
bool same_bits(const std::vector<Velocity>& a, const std::vector<Velocity>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), sizeof(Velocity) * a.size()) == 0;
}
bool same_bits(const Contacts& a, const Contacts& b) {
  return same_bits(a.rx, b.rx) && same_bits(a.ry, b.ry) && same_bits(a.rz, b.rz) && same_bits(a.rn, b.rn);
}
bool same_bits(const ErrorSums& a, const ErrorSums& b) {
  return std::memcmp(&a.residual2, &b.residual2, 8) == 0 &&
         std::memcmp(&a.residual_max2, &b.residual_max2, 8) == 0 &&
         std::memcmp(&a.impulse2, &b.impulse2, 8) == 0 && std::memcmp(&a.velocity2, &b.velocity2, 8) == 0 &&
         std::memcmp(&a.work, &b.work, 8) == 0 && std::memcmp(a.wall_impulse, b.wall_impulse, 24) == 0 &&
         a.contacts == b.contacts && a.active == b.active;
}

/// All that the kernels leave behind.
struct Outcome {
  std::vector<Velocity> velocity;
  Contacts contacts;
  std::vector<WallCopy> walls;
  std::vector<ErrorSums> errors;
};

struct Plan {
  double mu = 0.3;
  bool own_mu = false;  ///< of each contact, as set_own_friction gives it
  double wall_inv_mass = 0;
  std::vector<std::uint16_t> multiplicity = {};
  int sweeps = 5;
  ChunkFriction friction() const { return own_mu ? ChunkFriction::of_each_contact() : mu; }
};

template <bool Friction, class Kernels>
Outcome run(const Kernels& kernels, const Sample& sample, const Plan& plan) {
  Outcome out{sample.bodies.velocity, sample.contacts, {}, {}};
  out.walls.resize(sample.chunks.size());
  const Multiplicities multiplicity(plan.multiplicity);
  SweepSteps steps;
  steps.x.resize(out.contacts.rx.size());
  steps.y = steps.z = steps.x;
  steps.n.resize(out.contacts.rn.size());
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    out.walls[c] = {{0.1, -0.2, 0.05}, plan.wall_inv_mass};
  const auto measure = [&] {
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      out.errors.push_back(
          sample.chunks.wall[c] < 0
              ? kernels.template error_grains<Friction>(out.contacts, sample.range(c), out.velocity,
                                                        plan.friction(), multiplicity)
              : kernels.template error_wall<Friction>(out.contacts, sample.range(c), out.velocity,
                                                      plan.friction(), out.walls[c], multiplicity));
  };
  measure();
  for (int s = 0; s < plan.sweeps; ++s)
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
      // Plain and with momentum by turns.
      const SweepMomentum momentum{0.9, 1.2, steps};
      if (sample.chunks.wall[c] < 0 && s % 2 == 0)
        kernels.template sweep_grains<Friction>(out.contacts, sample.range(c), out.velocity, plan.friction());
      else if (sample.chunks.wall[c] < 0)
        kernels.template sweep_grains<Friction>(out.contacts, sample.range(c), out.velocity, plan.friction(),
                                                momentum);
      else if (s % 2 == 0)
        kernels.template sweep_wall<Friction>(out.contacts, sample.range(c), out.velocity, plan.friction(),
                                              out.walls[c]);
      else
        kernels.template sweep_wall<Friction>(out.contacts, sample.range(c), out.velocity, plan.friction(),
                                              out.walls[c], momentum);
    }
  measure();
  for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
    if (sample.chunks.wall[c] < 0)
      kernels.template accumulate_grains<Friction>(out.contacts, sample.range(c), out.velocity);
    else
      kernels.template accumulate_wall<Friction>(out.contacts, sample.range(c), out.velocity, out.walls[c]);
  }
  return out;
}

void expect_same(const Outcome& a, const Outcome& b) {
  EXPECT_TRUE(same_bits(a.velocity, b.velocity));
  EXPECT_TRUE(same_bits(a.contacts, b.contacts));
  for (std::size_t c = 0; c < a.walls.size(); ++c)
    EXPECT_EQ(0, std::memcmp(&a.walls[c], &b.walls[c], sizeof(WallCopy))) << "copy of a wall " << c;
  for (std::size_t k = 0; k < a.errors.size(); ++k)
    EXPECT_TRUE(same_bits(a.errors[k], b.errors[k])) << "error of chunk " << k % a.walls.size();
}

template <bool Friction>
void expect_reference_bits(const Sample& sample, const Plan& plan) {
  for (const InstructionSet set : test::sets_to_test()) {
    SCOPED_TRACE(name_of(set));
    expect_same(run<Friction>(SweepKernels(set), sample, plan),
                run<Friction>(test::ReferenceSweeps{}, sample, plan));
  }
}

void start_from_random_impulses(Sample& sample, std::uint64_t seed) {
  Random random(seed);
  for (double& r : sample.candidates.impulse.values()) r = uniform(random, 0, 300);
  test::find_contacts(sample, 0.06);
}

// Chunks from one contact to many groups; contacts that open, stick and slide; walls fixed and light.
TEST(SweepKernels, GiveTheBitsOfThePlainReferenceOnEveryInstructionSet) {
  for (int target : {1, 5, 16, 37, 100, 384})
    for (double wall_inv_mass : {0.0, 1e-3}) {
      SCOPED_TRACE(testing::Message() << "chunks of " << target << ", 1/M of walls " << wall_inv_mass);
      Sample sample = test::dense_sample(6, 11, true, true, target);
      start_from_random_impulses(sample, 3);
      expect_reference_bits<true>(sample, {.mu = 0.3, .wall_inv_mass = wall_inv_mass});
      Sample smooth = test::dense_sample(6, 12, false, true, target);
      start_from_random_impulses(smooth, 4);
      expect_reference_bits<false>(smooth, {.mu = 0, .wall_inv_mass = wall_inv_mass});
    }
}

TEST(SweepKernels, GiveTheReferenceBitsOfContactsThatHaveFrictionOfTheirOwn) {
  for (int target : {1, 16, 37, 384}) {
    SCOPED_TRACE(testing::Message() << "chunks of " << target);
    Sample sample = test::dense_sample(6, 21, true, true, target);
    start_from_random_impulses(sample, 8);
    Random random(9);
    for (std::size_t k = 0; k < sample.contacts.nx.size(); ++k)
      sample.contacts.mu.push_back(k % 3 == 0 ? 0 : uniform(random, 0, 1));
    expect_reference_bits<true>(sample, {.mu = std::nan(""), .own_mu = true, .wall_inv_mass = 1e-3});
  }
}

// The same coefficient everywhere, told once or told by every contact.
TEST(SweepKernels, GiveTheBitsOfOneCoefficientWhereEveryContactHasTheSame) {
  for (const InstructionSet set : test::sets_to_test()) {
    SCOPED_TRACE(name_of(set));
    Sample sample = test::dense_sample(6, 22, true, true, 100);
    start_from_random_impulses(sample, 10);
    const Outcome one = run<true>(SweepKernels(set), sample, {.mu = 0.3, .wall_inv_mass = 1e-3});
    sample.contacts.mu.assign(sample.contacts.nx.size(), 0.3);
    const Outcome own =
        run<true>(SweepKernels(set), sample, {.mu = 0, .own_mu = true, .wall_inv_mass = 1e-3});
    expect_same(one, own);
  }
}

TEST(SweepKernels, SeeOpenStickingAndSlidingContactsInTheTestAbove) {
  Sample sample = test::dense_sample(6, 11, true, true, 100);
  start_from_random_impulses(sample, 3);
  const Outcome out = run<true>(SweepKernels(best_instruction_set()), sample, {.mu = 0.3});
  int open = 0, stick = 0, slide = 0;
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k) {
      const Contacts& contacts = out.contacts;
      const Vec3 r(contacts.rx[k], contacts.ry[k], contacts.rz[k]),
          n(contacts.nx[k], contacts.ny[k], contacts.nz[k]);
      const double r_n = r.dot(n), r_t = (r - r_n * n).norm();
      if (r_n < 1e-12)
        ++open;
      else if (r_t < 0.999 * 0.3 * r_n)
        ++stick;
      else
        ++slide;
    }
  EXPECT_GT(std::min({open, stick, slide}), 50) << open << " " << stick << " " << slide;
}

TEST(SweepKernels, GiveTheReferenceBitsWithoutFrictionAtRubbingGrainsAndForGrainsThatNothingMoves) {
  Sample sample = test::dense_sample(5, 13, true, true, 64);
  Random random(2);
  for (Velocity& v : sample.bodies.velocity) {
    if (uniform(random, 0, 1) < 0.1) v.inv_mass = v.spin_mobility = 0;
    if (uniform(random, 0, 1) < 0.1) v.spin_mobility = 0;
  }
  // Two grains that nothing moves do not meet: W would be 0.
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k) {
      Velocity& a = sample.bodies.velocity[static_cast<std::size_t>(sample.contacts.first[k])];
      const Slot second = sample.contacts.second[k];
      const bool fixed = second < 0 || sample.bodies.velocity[static_cast<std::size_t>(second)].inv_mass == 0;
      if (fixed && a.inv_mass == 0) a.inv_mass = 0.01;
    }
  expect_reference_bits<true>(sample, {.mu = 0});
  expect_reference_bits<true>(sample, {.mu = 0.5});
}

TEST(SweepKernels, GiveTheReferenceErrorOfCopiesThatCarryAPartOfTheMass) {
  for (const bool friction : {false, true}) {
    Sample sample = test::dense_sample(5, 14, friction, true, 64);
    start_from_random_impulses(sample, 6);
    Plan plan{.mu = 0.3, .wall_inv_mass = 0.01};
    for (std::size_t s = 0; s < sample.bodies.size(); ++s)
      plan.multiplicity.push_back(static_cast<std::uint16_t>(1 + s % 4));
    friction ? expect_reference_bits<true>(sample, plan) : expect_reference_bits<false>(sample, plan);
  }
}

TEST(SweepKernels, LetNotANumberSpreadToTheErrorAndNeverSwallowIt) {
  for (const bool friction : {false, true})
    for (const InstructionSet set : test::sets_to_test()) {
      SCOPED_TRACE(name_of(set));
      Sample sample = test::dense_sample(4, 15, friction, false, 384);
      sample.bodies.velocity[20].u[1] = std::numeric_limits<double>::quiet_NaN();
      const SweepKernels kernels(set);
      const Outcome out =
          friction ? run<true>(kernels, sample, {.mu = 0.3}) : run<false>(kernels, sample, {.mu = 0});
      EXPECT_TRUE(std::isnan(out.errors.front().residual2));
      EXPECT_TRUE(std::isnan(out.errors.back().residual2));
      EXPECT_TRUE(std::isnan(out.velocity[20].u[1]));
    }
}

// The largest of 0 and a number that is none must not be 0: the contact would open in silence.
TEST(SweepKernels, KeepAnImpulseThatIsNoNumber) {
  for (const bool friction : {false, true})
    for (const InstructionSet set : test::sets_to_test()) {
      SCOPED_TRACE(name_of(set));
      Sample sample = test::dense_sample(4, 15, friction, false, 384);
      sample.contacts.bias.assign(sample.contacts.bias.size(), std::numeric_limits<double>::quiet_NaN());
      const SweepKernels kernels(set);
      const Plan once{.mu = 0, .sweeps = 1};
      const Outcome out = friction ? run<true>(kernels, sample, once) : run<false>(kernels, sample, once);
      for (std::size_t k = sample.range(0).begin; k < sample.range(0).end; ++k)
        ASSERT_TRUE(std::isnan(friction ? out.contacts.rx[k] : out.contacts.rn[k])) << k;
    }
}

TEST(InstructionSets, AreNamedAndRefusedWhereTheProcessorLacksThem) {
  for (const InstructionSet set : {InstructionSet::portable, InstructionSet::avx2, InstructionSet::avx512}) {
    EXPECT_EQ(instruction_set_of(name_of(set)), set);
    if (set <= best_instruction_set())
      EXPECT_EQ(SweepKernels(set).set(), set);
    else
      EXPECT_THROW(SweepKernels{set}, std::invalid_argument);
  }
  EXPECT_EQ(SweepKernels(InstructionSet::automatic).set(), best_instruction_set());
  EXPECT_FALSE(instruction_set_of("sse9"));
}

}  // namespace
}  // namespace talus
