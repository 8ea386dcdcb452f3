/// Sweeps in single precision: the bits of the scalar text that rounds alike, and the same answers as sweeps
/// in double.

#include "kernels/sweeps/single_precision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "kernels/sweeps/momentum.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

std::vector<Slot> all_slots(std::size_t bodies) {
  std::vector<Slot> slots(bodies);
  for (std::size_t s = 0; s < bodies; ++s) slots[s] = static_cast<Slot>(s);
  return slots;
}

/// Of the lightest grain, which has the largest 1/m.
double unit_of(const Bodies& bodies) {
  double most = 0;
  for (const Velocity& v : bodies.velocity) most = std::max(most, v.inv_mass);
  return unit_of_mass(most);
}

struct Swept {
  SingleState single;
  SweepSteps steps;
  std::vector<WallCopy> walls;
  Contacts contacts;  ///< impulses in N s
};

/// Sweeps with momentum over all chunks, bodies among them.
template <bool Friction, class Kernels>
Swept sweep(const test::Sample& sample, const Kernels& kernels, ChunkFriction mu, double wall_inv_mass,
            int sweeps) {
  const SweepKernels of_bodies(InstructionSet::portable);
  const std::size_t bodies = sample.bodies.size();
  const std::vector<Slot> slots = all_slots(bodies);
  Swept out;
  out.contacts = sample.contacts;
  out.steps.x.resize(out.contacts.rx.size());
  out.steps.y = out.steps.z = out.steps.x;
  out.steps.n.resize(out.contacts.rn.size());
  allocate(out.single, out.contacts, bodies);
  out.single.contacts.unit = unit_of(sample.bodies);
  narrow_bodies(slots, sample.bodies.velocity, out.single);
  for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
    out.walls.push_back({{0.1, -0.2, 0.05}, wall_inv_mass});
    narrow_geometry(out.contacts, sample.range(c), out.single.contacts);
    narrow_impulses(out.contacts, sample.range(c), out.single.contacts);
  }
  for (int s = 0; s < sweeps; ++s) {
    const double beta = s == 0 ? 0 : 0.8;
    carry_velocities(of_bodies, beta, slots, out.single.velocity, out.single.last_v);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      if (sample.chunks.wall[c] < 0)
        kernels.template sweep_grains<Friction>(out.contacts, out.single, sample.range(c), mu,
                                                {beta, 1.2, out.steps});
      else
        kernels.template sweep_wall<Friction>(out.contacts, out.single, sample.range(c), mu, out.walls[c],
                                              {beta, 1.2, out.steps});
  }
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    widen_impulses(out.single.contacts, sample.range(c), out.contacts);
  return out;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), sizeof(float) * a.size()) == 0);
}

template <bool Friction>
void expect_reference_bits(int target, double wall_inv_mass, ChunkFriction mu) {
  SCOPED_TRACE(testing::Message() << "chunks of " << target << ", walls " << wall_inv_mass << ", friction "
                                  << Friction << ", mu " << mu.mu << (mu.own ? " of each" : ""));
  test::Sample sample = test::dense_sample(6, 11, Friction, true, target);
  if (mu.own)
    for (std::size_t k = 0; k < sample.contacts.nx.size(); ++k)
      sample.contacts.mu.push_back(0.1 * static_cast<double>(k % 7));
  for (const InstructionSet set : test::sets_to_test()) {
    SCOPED_TRACE(name_of(set));
    const Swept expected = sweep<Friction>(sample, test::ReferenceSweeps{}, mu, wall_inv_mass, 5);
    const Swept swept = sweep<Friction>(sample, SweepKernels(set), mu, wall_inv_mass, 5);
    EXPECT_TRUE(same_bits(swept.single.contacts.rx, expected.single.contacts.rx));
    EXPECT_TRUE(same_bits(swept.single.contacts.ry, expected.single.contacts.ry));
    EXPECT_TRUE(same_bits(swept.single.contacts.rz, expected.single.contacts.rz));
    EXPECT_TRUE(same_bits(swept.single.contacts.rn, expected.single.contacts.rn));
    EXPECT_TRUE(same_bits(swept.steps.x, expected.steps.x));
    EXPECT_TRUE(same_bits(swept.steps.n, expected.steps.n));
    EXPECT_EQ(0, std::memcmp(swept.single.velocity.data(), expected.single.velocity.data(),
                             sizeof(SingleVelocity) * expected.single.velocity.size()));
    for (std::size_t c = 0; c < expected.walls.size(); ++c)
      EXPECT_EQ(0, std::memcmp(&swept.walls[c], &expected.walls[c], sizeof(WallCopy))) << c;
  }
}

// Chunks from one contact to many groups; walls fixed and light; friction, mu = 0, and no friction at all.
TEST(SingleSweeps, GiveTheBitsOfThePlainReferenceOnEveryInstructionSet) {
  for (const int target : {1, 5, 16, 37, 384})
    for (const double wall_inv_mass : {0.0, 1e-3}) {
      for (const double mu : {0.3, 0.0}) expect_reference_bits<true>(target, wall_inv_mass, mu);
      expect_reference_bits<true>(target, wall_inv_mass, ChunkFriction::of_each_contact());
      expect_reference_bits<false>(target, wall_inv_mass, 0);
    }
}

/// Of the impulses in double and in single precision after as many sweeps, over the largest: how far apart.
template <bool Friction>
double difference_to_double(double mu, int sweeps) {
  const test::Sample sample = test::dense_sample(6, 11, Friction, true, 100);
  const Swept single = sweep<Friction>(sample, SweepKernels(best_instruction_set()), mu, 1e-4, sweeps);

  const SweepKernels kernels(best_instruction_set());
  const std::vector<Slot> slots = all_slots(sample.bodies.size());
  Contacts contacts = sample.contacts;
  std::vector<Velocity> velocity = sample.bodies.velocity;
  std::vector<WallCopy> walls(sample.chunks.size(), {{0.1, -0.2, 0.05}, 1e-4});
  AccelerationHistory acceleration;
  allocate(acceleration, Carry::momentum, contacts, {velocity.size(), walls.size(), 0});
  for (int s = 0; s < sweeps; ++s) {
    const double beta = s == 0 ? 0 : 0.8;
    carry_velocities(kernels, Carry::momentum, beta, slots, velocity, acceleration);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      if (sample.chunks.wall[c] < 0)
        kernels.sweep_grains<Friction>(contacts, sample.range(c), velocity, mu,
                                       {beta, 1.2, acceleration.steps});
      else
        kernels.sweep_wall<Friction>(contacts, sample.range(c), velocity, mu, walls[c],
                                     {beta, 1.2, acceleration.steps});
  }
  const std::vector<double>&r = Friction ? contacts.rx : contacts.rn,
        &r_single = Friction ? single.contacts.rx : single.contacts.rn;
  double largest = 0, difference = 0;
  for (std::size_t k = 0; k < r.size(); ++k) {
    largest = std::max(largest, std::abs(r[k]));
    difference = std::max(difference, std::abs(r[k] - r_single[k]));
  }
  EXPECT_GT(largest, 0);
  return difference / largest;
}

TEST(SingleSweeps, FollowThoseInDouble) {
  for (const double difference : {difference_to_double<true>(0.3, 30), difference_to_double<false>(0, 30)}) {
    EXPECT_GT(difference, 0);
    EXPECT_LT(difference, 2e-5);
  }
}

// Squares of what is smaller than 1e-22 are 0 in floats. What was left of a tangential impulse then made a
// contact of grains far from one another one that carries.
TEST(SingleSweeps, LeaveNothingAtContactsThatCarryNothing) {
  test::Sample sample = test::dense_sample(6, 11, true, false, 100);
  for (Velocity& v : sample.bodies.velocity)
    for (int d = 0; d < 3; ++d) {
      v.u[d] *= 1e-24;
      v.w[d] *= 1e-24;
    }
  std::fill(sample.contacts.bias.begin(), sample.contacts.bias.end(), 1.0);
  for (const InstructionSet set : test::sets_to_test()) {
    const Swept out = sweep<true>(sample, SweepKernels(set), 0.3, 0, 4);
    for (std::size_t k = 0; k < out.contacts.rx.size(); ++k) {
      ASSERT_EQ(out.contacts.rx[k], 0) << name_of(set) << ", contact " << k;
      ASSERT_EQ(out.contacts.rz[k], 0) << name_of(set) << ", contact " << k;
    }
  }
}

TEST(SingleSweeps, KeepAnImpulseThatIsNoNumber) {
  test::Sample sample = test::dense_sample(4, 15, true, false, 384);
  sample.contacts.bias.assign(sample.contacts.bias.size(), std::numeric_limits<double>::quiet_NaN());
  for (const InstructionSet set : test::sets_to_test()) {
    const Swept out = sweep<true>(sample, SweepKernels(set), 0, 0, 1);
    EXPECT_TRUE(std::isnan(out.contacts.rx[sample.range(0).begin])) << name_of(set);
  }
}

// Added to the wall's own velocity of 0.2 m/s in floats, what it gains would be lost.
TEST(SingleSweeps, MoveAWallThatIsMuchHeavierThanTheGrains) {
  const double inv_mass = 1e-13;
  const test::Sample sample = test::dense_sample(6, 11, true, true, 384);
  const Swept out = sweep<true>(sample, SweepKernels(best_instruction_set()), 0.3, inv_mass, 1);
  int walls = 0;
  for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
    if (sample.chunks.wall[c] < 0) continue;
    double along_normal = 0, gained = 0;
    for (std::size_t k = sample.range(c).begin; k < sample.range(c).end; ++k) {
      const Vec3 r(out.contacts.rx[k], out.contacts.ry[k], out.contacts.rz[k]),
          before(sample.contacts.rx[k], sample.contacts.ry[k], sample.contacts.rz[k]),
          n(out.contacts.nx[k], out.contacts.ny[k], out.contacts.nz[k]);
      along_normal += (r - before).dot(n);
      const Vec3 dv = Vec3(out.walls[c].velocity) - Vec3(0.1, -0.2, 0.05);
      gained = -dv.dot(n);
    }
    if (along_normal == 0) continue;
    ++walls;
    EXPECT_NEAR(gained, inv_mass * along_normal, 1e-4 * std::abs(inv_mass * along_normal)) << c;
  }
  EXPECT_GT(walls, 3);
}

TEST(SingleSweeps, ChangeNoBitWithTheUnitOfMass) {
  test::Sample sample = test::dense_sample(5, 11, true, true, 100);
  const Swept in_kg = sweep<true>(sample, SweepKernels(best_instruction_set()), 0.3, std::exp2(-10), 5);
  const double factor = std::exp2(70);  // far beyond what floats can square
  for (Velocity& v : sample.bodies.velocity) {
    v.inv_mass /= factor;
    v.spin_mobility /= factor;
  }
  const Swept scaled =
      sweep<true>(sample, SweepKernels(best_instruction_set()), 0.3, std::exp2(-10) / factor, 5);
  double largest = 0;
  for (std::size_t k = 0; k < in_kg.contacts.ry.size(); ++k) {
    largest = std::max(largest, std::abs(in_kg.contacts.ry[k]));
    ASSERT_EQ(scaled.contacts.ry[k], factor * in_kg.contacts.ry[k]) << k;
  }
  EXPECT_GT(largest, 0);
}

/// A packing of `edge`^3 grains, pressed on three sides.
struct Pressed {
  talus::Setup setup;
  Bodies bodies;

  explicit Pressed(int edge, double tolerance, double friction = 0.3)
      : bodies(test::jittered_lattice(edge, 5, 0.1)) {
    setup = test::pressed_setup(test::box_of_walls(-0.6, edge - 0.4), friction, 4, 1e6, 1e4);
    setup.solver.tolerance = tolerance;
  }
  struct Outcome {
    std::uint64_t digest;
    double error;  ///< of the last step, like the sweeps
    int sweeps;
  };
  Outcome run(Precision precision, int threads = 1) {
    setup.solver.precision = precision;
    graph::Executor executor({.threads = threads});
    Simulation simulation(setup, bodies, executor);
    for (int k = 0; k < 4; ++k) simulation.step();
    return {simulation.digest(), simulation.report().error_rms, simulation.report().iterations};
  }
};

// The change to double precision within a step keeps the momentum, at whatever sweep a check calls for it.
TEST(MixedPrecision, ReachesWhatDoubleReaches) {
  for (const double friction : {0.3, 0.0})
    for (const double tolerance : {1e-3, 1e-6, 1e-8})
      for (const int check_every : {2, 5, 10}) {
        SCOPED_TRACE(testing::Message()
                     << "friction " << friction << ", " << tolerance << ", checks every " << check_every);
        Pressed pressed(8, tolerance, friction);
        pressed.setup.solver.check_every = check_every;
        const Pressed::Outcome mixed = pressed.run(Precision::mixed), full = pressed.run(Precision::full);
        EXPECT_NE(mixed.digest, full.digest) << "single precision was not used";
        EXPECT_LE(mixed.error, tolerance);
        EXPECT_LE(full.error, tolerance);
        EXPECT_LE(mixed.sweeps, 1.1 * full.sweeps + 5);
      }
}

TEST(MixedPrecision, IsDoubleInSmallProblems) {
  Pressed pressed(5, 1e-3);
  EXPECT_EQ(pressed.run(Precision::mixed).digest, pressed.run(Precision::full).digest);
}

// To 1e-6 the last sweeps are in double.
TEST(MixedPrecision, HasTheSameBitsOnAnyThreadsAndVectors) {
  for (const int subdomains : {1, 5})
    for (const auto& [tolerance, friction] :
         {std::pair(1e-3, 0.3), std::pair(1e-6, 0.3), std::pair(1e-6, 0.0)}) {
      SCOPED_TRACE(testing::Message()
                   << subdomains << " subdomains, tolerance " << tolerance << ", friction " << friction);
      Pressed pressed(8, tolerance, friction);
      pressed.setup.decomposition.subdomains = subdomains;
      const std::uint64_t expected = pressed.run(Precision::mixed).digest;
      for (const InstructionSet set : test::sets_to_test()) {
        pressed.setup.solver.simd = set;
        const std::uint64_t digest = pressed.run(Precision::mixed).digest;
        EXPECT_EQ(pressed.run(Precision::mixed, 2).digest, digest) << name_of(set);
        EXPECT_EQ(digest, expected) << name_of(set);
      }
    }
}

}  // namespace
}  // namespace talus
