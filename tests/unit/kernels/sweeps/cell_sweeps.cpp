/// Sweeps in a cell that follows a stress: the same bits by every instruction set, and a copy that gains the
/// momentum that its contacts gave it, in double and in single precision.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/sweeps/cell_copy.hpp"
#include "kernels/sweeps/momentum.hpp"
#include "kernels/sweeps/single_precision.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::cell_sweeps_test {
namespace {

/// What a few sweeps leave, plain and with momentum by turns, in a chunk between grains.
struct Outcome {
  std::vector<Velocity> velocity;
  Contacts contacts;
  CellCopy cell;
  CellVelocity given{};  ///< to the cell by the contacts [N s]
  double error = 0;
};

/// The contacts of the sample, as in a cell: of branches that differ, and with images that drift.
Contacts in_cell(const test::Sample& sample) {
  Contacts contacts = sample.contacts;
  contacts.reach.resize(contacts.nx.size());
  for (std::size_t k = 0; k < contacts.reach.size(); ++k)
    contacts.reach[k] = 1 + 0.1 * std::sin(static_cast<double>(k));
  contacts.drifts_between = true;
  for (auto* drift : {&contacts.vx, &contacts.vy, &contacts.vz})
    drift->assign(contacts.nx.size(), drift == &contacts.vy ? 0.01 : 0);
  return contacts;
}

SweepSteps steps_for(const Contacts& contacts) {
  SweepSteps steps;
  steps.x.resize(contacts.rx.size());
  steps.y = steps.z = steps.x;
  steps.n.resize(contacts.rn.size());
  return steps;
}

template <bool Friction>
Outcome sweep(InstructionSet set, const test::Sample& sample, std::size_t chunk, const CellCopy& cell) {
  Outcome out{sample.bodies.velocity, in_cell(sample), cell};
  Contacts& contacts = out.contacts;
  const SweepKernels kernels(set);
  SweepSteps steps = steps_for(contacts);
  const CellVelocity before = impulse_on_cell(contacts, sample.range(chunk));
  for (int s = 0; s < 4; ++s) {
    if (s % 2 == 0) {
      kernels.sweep_cell<Friction>(contacts, sample.range(chunk), out.velocity, 0.3, out.cell);
      continue;
    }
    const SweepMomentum momentum{0, 1.2, steps};
    kernels.sweep_cell<Friction>(contacts, sample.range(chunk), out.velocity, 0.3, out.cell, momentum);
  }
  out.given = impulse_on_cell(contacts, sample.range(chunk));
  for (std::size_t k = 0; k < cell_freedoms; ++k) out.given[k] -= before[k];
  out.error =
      kernels.error_cell<Friction>(contacts, sample.range(chunk), out.velocity, 0.3, out.cell).residual2;
  return out;
}

CellCopy some_cell() {
  CellCopy cell;
  cell.velocity = {0.02, -0.01, 0.03, 0.01, -0.02, 0.005};
  cell.inv_mass = {40, 0, 40, 40, 0, 40};
  return cell;
}

template <bool Friction>
void expect_momentum_and_bits(std::uint64_t seed) {
  const test::Sample sample = test::dense_sample(6, seed, Friction, false, 100);
  for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
    if (sample.chunks.wall[c] >= 0 || sample.range(c).begin == sample.range(c).end) continue;
    const Outcome one = sweep<Friction>(InstructionSet::portable, sample, c, some_cell());
    for (std::size_t k = 0; k < cell_freedoms; ++k) {
      const double gained = one.cell.velocity[k] - some_cell().velocity[k];
      EXPECT_NEAR(gained, some_cell().inv_mass[k] * one.given[k], 1e-12 * (1 + std::abs(gained)))
          << "chunk " << c << " component " << k;
    }
    for (const InstructionSet set : test::sets_to_test()) {
      const Outcome other = sweep<Friction>(set, sample, c, some_cell());
      EXPECT_EQ(other.cell.velocity, one.cell.velocity) << name_of(set);
      EXPECT_EQ(other.contacts.rx, one.contacts.rx) << name_of(set);
      EXPECT_EQ(other.contacts.rn, one.contacts.rn) << name_of(set);
      EXPECT_EQ(other.error, one.error) << name_of(set);
      EXPECT_EQ(
          0, std::memcmp(other.velocity.data(), one.velocity.data(), sizeof(Velocity) * one.velocity.size()))
          << name_of(set);
    }
  }
}

TEST(CellSweeps, GiveTheCellWhatContactsGiveAndTheSameBitsByEveryInstructionSet) {
  expect_momentum_and_bits<true>(3);
  expect_momentum_and_bits<false>(4);
}

/// Sweeps of all chunks between grains, each with a copy of its own, in single or in double precision, with
/// `beta` of momentum in the contacts from the second sweep on.
struct Swept {
  Contacts contacts;
  SingleState single;
  std::vector<CellCopy> copies;
};

template <bool Friction>
Swept sweep_all(InstructionSet set, const test::Sample& sample, const CellCopy& cell, bool in_single,
                int sweeps) {
  constexpr double beta = 0.5, omega = 1.2;
  const ChunkFriction friction = sample.contacts.mu.empty() ? 0.3 : ChunkFriction::of_each_contact();
  Swept out{in_cell(sample), {}, std::vector(sample.chunks.size(), cell)};
  std::vector<Velocity> velocity = sample.bodies.velocity;
  std::vector<Slot> slots;
  double most = 0;
  for (std::size_t s = 0; s < velocity.size(); ++s) {
    slots.push_back(static_cast<Slot>(s));
    most = std::max(most, velocity[s].inv_mass);
  }
  allocate(out.single, out.contacts, velocity.size());
  out.single.contacts.unit = unit_of_mass(most);
  narrow_bodies(slots, velocity, out.single);
  const ContactRange all{0, out.contacts.nx.size()};
  narrow_geometry(out.contacts, all, out.single.contacts);
  narrow_impulses(out.contacts, all, out.single.contacts);
  const SweepKernels kernels(set);
  SweepSteps steps = steps_for(out.contacts);
  for (int s = 0; s < sweeps; ++s) {
    const SweepMomentum momentum{s == 0 ? 0 : beta, omega, steps};
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
      if (sample.chunks.wall[c] >= 0) continue;
      if (in_single)
        kernels.sweep_cell<Friction>(out.contacts, out.single, sample.range(c), friction, out.copies[c],
                                     momentum);
      else
        kernels.sweep_cell<Friction>(out.contacts, sample.range(c), velocity, friction, out.copies[c],
                                     momentum);
    }
  }
  if (in_single) widen_impulses(out.single.contacts, all, out.contacts);
  return out;
}

/// All of their components, one after the other.
std::vector<double> impulses_of(const Contacts& contacts) {
  std::vector<double> all;
  for (const auto* part : {&contacts.rx, &contacts.ry, &contacts.rz, &contacts.rn})
    all.insert(all.end(), part->begin(), part->end());
  return all;
}

template <bool Friction>
void expect_single_as_double(std::uint64_t seed, bool own_friction = false) {
  test::Sample sample = test::dense_sample(6, seed, Friction, false, 100);
  for (std::size_t k = 0; own_friction && k < sample.contacts.nx.size(); ++k)
    sample.contacts.mu.push_back(0.1 * static_cast<double>(k % 7));
  CellCopy cell = some_cell();
  for (double& of : cell.inv_mass) of *= 1e-3;
  const int sweeps = 6;
  const Swept full = sweep_all<Friction>(InstructionSet::portable, sample, cell, false, sweeps),
              single = sweep_all<Friction>(InstructionSet::portable, sample, cell, true, sweeps);
  const std::vector<double> r = impulses_of(full.contacts), r_single = impulses_of(single.contacts);
  double largest = 0, off = 0, gained = 0, off_gained = 0;
  for (std::size_t k = 0; k < r.size(); ++k) {
    largest = std::max(largest, std::abs(r[k]));
    off = std::max(off, std::abs(r[k] - r_single[k]));
  }
  for (std::size_t c = 0; c < full.copies.size(); ++c)
    for (std::size_t k = 0; k < cell_freedoms; ++k) {
      gained = std::max(gained, std::abs(full.copies[c].velocity[k] - cell.velocity[k]));
      off_gained = std::max(off_gained, std::abs(full.copies[c].velocity[k] - single.copies[c].velocity[k]));
    }
  EXPECT_GT(off, 0) << "not in single precision";
  EXPECT_LT(off, 2e-5 * largest);
  EXPECT_LT(off_gained, 2e-5 * gained);
  for (const InstructionSet set : test::sets_to_test()) {
    const Swept other = sweep_all<Friction>(set, sample, cell, true, sweeps);
    EXPECT_EQ(impulses_of(other.contacts), r_single) << name_of(set);
    EXPECT_EQ(0, std::memcmp(other.single.velocity.data(), single.single.velocity.data(),
                             sizeof(SingleVelocity) * single.single.velocity.size()))
        << name_of(set);
    for (std::size_t c = 0; c < other.copies.size(); ++c)
      EXPECT_EQ(other.copies[c].velocity, single.copies[c].velocity) << name_of(set) << ", chunk " << c;
  }
}

TEST(CellSweeps, InSinglePrecisionFollowThoseInDoubleWithTheSameBitsByEveryInstructionSet) {
  expect_single_as_double<true>(3);
  expect_single_as_double<true>(5, true);
  expect_single_as_double<false>(4);
}

// Added to the cell's own velocity of 0.03 m/s in floats, what it gains would be lost.
TEST(CellSweeps, InSinglePrecisionMoveACellThatIsMuchHeavierThanTheGrains) {
  const test::Sample sample = test::dense_sample(6, 3, true, false, 384);
  CellCopy cell = some_cell();
  cell.inv_mass = {1e-13, 1e-13, 1e-13, 1e-13, 1e-13, 1e-13};
  const Swept out = sweep_all<true>(best_instruction_set(), sample, cell, true, 1);
  const Contacts before = in_cell(sample);
  int chunks = 0;
  for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
    if (sample.chunks.wall[c] >= 0) continue;
    const CellVelocity after = impulse_on_cell(out.contacts, sample.range(c)),
                       earlier = impulse_on_cell(before, sample.range(c));
    double largest = 0;
    for (std::size_t k = 0; k < cell_freedoms; ++k)
      largest = std::max(largest, std::abs(after[k] - earlier[k]));
    for (std::size_t k = 0; k < cell_freedoms; ++k)
      EXPECT_NEAR(out.copies[c].velocity[k] - cell.velocity[k], 1e-13 * (after[k] - earlier[k]),
                  1e-4 * 1e-13 * largest)
          << "chunk " << c << ", component " << k;
    chunks += largest > 0 ? 1 : 0;
  }
  EXPECT_GT(chunks, 1);
}

/// Of bodies that touch, sum r (x) (x_i - x_j)/d over contacts is the moment of what each body gets.
TEST(CellSweeps, WhatGoesThroughACellIsTheMomentOfWhatItsBodiesGet) {
  const double length = 0.7;
  const std::vector<double> radius{1, 2, 0.5, 3};
  std::vector<Vec3> x{{4, -1, 2}};
  Contacts contacts;
  std::vector<Vec3> given(radius.size(), Vec3::Zero());
  for (std::size_t k = 0; k + 1 < radius.size(); ++k) {
    const Vec3 n = Vec3(0.3 - static_cast<double>(k), 0.8, 0.1 + 0.4 * static_cast<double>(k)).normalized(),
               r = (2 + static_cast<double>(k)) * n + 0.3 * n.unitOrthogonal();
    x.push_back(x[k] - (radius[k] + radius[k + 1]) * n);
    contacts.first.push_back(static_cast<Slot>(k));
    contacts.second.push_back(static_cast<Slot>(k + 1));
    contacts.nx.push_back(n[0]);
    contacts.ny.push_back(n[1]);
    contacts.nz.push_back(n[2]);
    contacts.rx.push_back(r[0]);
    contacts.ry.push_back(r[1]);
    contacts.rz.push_back(r[2]);
    given[k] += r;
    given[k + 1] -= r;
  }
  CellVelocity moment{};
  for (std::size_t b = 0; b < given.size(); ++b) add_impulse(given[b], x[b] / length, moment);
  const CellVelocity found = impulse_through_cell(contacts, {0, contacts.nx.size()}, radius, length);
  for (std::size_t k = 0; k < cell_freedoms; ++k) {
    EXPECT_NEAR(found[k], moment[k], 1e-12) << "component " << k;
    EXPECT_GT(std::abs(moment[k]), 0.1);
  }
}

}  // namespace
}  // namespace talus::cell_sweeps_test
