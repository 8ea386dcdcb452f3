/// Walls whose material moves otherwise than the wall: sweeps, error and momentum, in double and in single
/// precision, must not tell a velocity of the wall from the same velocity of its material.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/sweeps/momentum.hpp"
#include "kernels/sweeps/single_precision.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::drift_test {
namespace {

const Vec3 speed(0.3, -0.2, 0.1);  // [m/s]

/// Grains pressed against six walls; chunks at walls have lengths that fill no lanes.
struct AtWalls {
  test::Sample sample;
  std::vector<WallCopy> copies;

  AtWalls(bool by_drift, bool friction) {
    sample.bodies = test::jittered_lattice(7, 3);
    sample.walls = test::box_of_walls(-0.45, 6.45);
    sample.candidates = test::find_candidates(sample.bodies, sample.walls, 0.1, friction);
    sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 29);
    allocate(sample.contacts, sample.candidates, sample.chunks, friction);
    if (by_drift)
      for (auto* values : {&sample.contacts.vx, &sample.contacts.vy, &sample.contacts.vz})
        values->resize(sample.candidates.size());
    const PairTable laws = laws_of_one_material(0.3, 0.3, 0);
    const NarrowPhase in{.x = sample.bodies.x,
                         .radius = sample.bodies.radius,
                         .velocity = sample.bodies.velocity,
                         .walls = sample.walls,
                         .time_step = 1e-3,
                         .alert = 0.05,
                         .laws = laws,
                         .gravity = Vec3::Zero()};
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      narrow_chunk(in, sample.candidates, sample.chunks, c, InstructionSet::automatic, sample.contacts);
    for (std::size_t k = 0; k < sample.contacts.vx.size(); ++k) set_drift(sample.contacts, k, speed);
    copies.resize(sample.chunks.size());
    for (WallCopy& copy : copies)
      if (!by_drift) std::copy_n(speed.data(), 3, copy.velocity);
  }
  bool at_wall(std::size_t c) const { return sample.chunks.wall[c] >= 0; }
};

double largest_difference(const std::vector<Velocity>& a, const std::vector<Velocity>& b) {
  double most = 0;
  for (std::size_t s = 0; s < a.size(); ++s)
    for (int c = 0; c < 3; ++c)
      most = std::max({most, std::abs(a[s].u[c] - b[s].u[c]), std::abs(a[s].w[c] - b[s].w[c])});
  return most;
}

template <bool Friction>
void sweep_walls(AtWalls& at, InstructionSet set, int sweeps) {
  const SweepKernels kernels(set);
  for (int k = 0; k < sweeps; ++k)
    for (std::size_t c = 0; c < at.sample.chunks.size(); ++c)
      if (at.at_wall(c))
        kernels.sweep_wall<Friction>(at.sample.contacts, at.sample.range(c), at.sample.bodies.velocity, 0.3,
                                     at.copies[c]);
}

template <bool Friction>
void expect_alike() {
  for (const InstructionSet set : {InstructionSet::portable, InstructionSet::automatic}) {
    AtWalls moving(false, Friction), drifting(true, Friction);
    sweep_walls<Friction>(moving, set, 3);
    sweep_walls<Friction>(drifting, set, 3);
    EXPECT_EQ(largest_difference(moving.sample.bodies.velocity, drifting.sample.bodies.velocity), 0);
    const SweepKernels kernels(set);
    double moved = 0;
    for (const Velocity& v : moving.sample.bodies.velocity) moved = std::max(moved, std::abs(v.u[0]));
    EXPECT_GT(moved, 0.01);
    for (std::size_t c = 0; c < moving.sample.chunks.size(); ++c) {
      if (!moving.at_wall(c)) continue;
      const auto error = [&](AtWalls& at) {
        return kernels
            .error_wall<Friction>(at.sample.contacts, at.sample.range(c), at.sample.bodies.velocity, 0.3,
                                  at.copies[c])
            .residual2;
      };
      EXPECT_EQ(error(moving), error(drifting));
    }
  }
}

TEST(Drift, IsSweptAsTheVelocityOfAWallWithFriction) {
  expect_alike<true>();
}

TEST(Drift, IsSweptAsTheVelocityOfAWallWithoutFriction) {
  expect_alike<false>();
}

TEST(Drift, IsSweptInSinglePrecisionToo) {
  const auto swept = [](bool by_drift) {
    AtWalls at(by_drift, true);
    SingleState single;
    single.contacts.unit = unit_of_mass(at.sample.bodies.velocity[0].inv_mass);
    allocate(single, at.sample.contacts, at.sample.bodies.size());
    std::vector<Slot> all(at.sample.bodies.size());
    for (std::size_t s = 0; s < all.size(); ++s) all[s] = static_cast<Slot>(s);
    narrow_bodies(all, at.sample.bodies.velocity, single);
    AccelerationHistory history;
    allocate(history, Carry::momentum, at.sample.contacts, {0, at.sample.chunks.size(), 0});
    const SweepKernels kernels(InstructionSet::automatic);
    for (std::size_t c = 0; c < at.sample.chunks.size(); ++c) {
      narrow_geometry(at.sample.contacts, at.sample.range(c), single.contacts);
      narrow_impulses(at.sample.contacts, at.sample.range(c), single.contacts);
      begin_steps(at.sample.range(c), history.steps);
      if (at.at_wall(c))
        kernels.sweep_wall<true>(at.sample.contacts, single, at.sample.range(c), 0.3, at.copies[c],
                                 SweepMomentum{0, 1, history.steps});
    }
    std::vector<Velocity> velocity = at.sample.bodies.velocity;
    widen_bodies(all, single.velocity, velocity);
    return velocity;
  };
  EXPECT_EQ(largest_difference(swept(false), swept(true)), 0);
}

}  // namespace
}  // namespace talus::drift_test
