/// Sweeps in a cell that follows a stress: the same bits by every instruction set, and a copy that gains the
/// momentum that its contacts gave it.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "kernels/sweeps/cell_copy.hpp"
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

template <bool Friction>
Outcome sweep(InstructionSet set, const test::Sample& sample, std::size_t chunk, const CellCopy& cell) {
  Outcome out{sample.bodies.velocity, sample.contacts, cell};
  Contacts& contacts = out.contacts;
  contacts.reach.resize(contacts.nx.size());
  for (std::size_t k = 0; k < contacts.reach.size(); ++k)
    contacts.reach[k] = 1 + 0.1 * std::sin(static_cast<double>(k));
  contacts.drifts_between = true;
  for (auto* drift : {&contacts.vx, &contacts.vy, &contacts.vz})
    drift->assign(contacts.nx.size(), drift == &contacts.vy ? 0.01 : 0);
  const SweepKernels kernels(set);
  SweepSteps steps;
  steps.x.resize(contacts.rx.size());
  steps.y = steps.z = steps.x;
  steps.n.resize(contacts.rn.size());
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
