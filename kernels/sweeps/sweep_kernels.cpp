#include "kernels/sweeps/sweep_kernels.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <stdexcept>
#include <string>

#include "kernels/simd/contact_view.hpp"
#include "kernels/sweeps/cell_copy.hpp"
#include "kernels/sweeps/single_precision.hpp"

namespace talus {

namespace {

/// Lane kernels see a body as 8 doubles.
static_assert(offsetof(Velocity, u) == 0 && offsetof(Velocity, inv_mass) == 24 &&
              offsetof(Velocity, w) == 32 && offsetof(Velocity, spin_mobility) == 56);
double* records(std::span<Velocity> velocity) {
  return reinterpret_cast<double*>(velocity.data());
}
const double* records(std::span<const Velocity> velocity) {
  return reinterpret_cast<const double*>(velocity.data());
}

float* records(std::span<SingleVelocity> velocity) {
  return reinterpret_cast<float*>(velocity.data());
}

ImpulseView impulses(Contacts& c) {
  return {c.rx.data(), c.ry.data(), c.rz.data(), c.rn.data()};
}

/// Where contacts are: between grains, where drifts may be unused, or at a wall.
enum class Between { grains, wall };

/// `arrays` are Contacts or SingleContacts; bodies and groups are those of `contacts`.
template <class Number, class Arrays, class Record>
ContactViewOf<Number> view(const Contacts& contacts, const Arrays& arrays, ContactRange range,
                           std::span<Record> velocity, Between between) {
  constexpr std::size_t near = std::size_t{256} << 10;  // [bytes]: with fewer, prefetching does not pay
  const bool drifts = between == Between::wall || contacts.drifts_between;
  const auto drift = [&](const std::vector<Number>& v) { return v.empty() || !drifts ? nullptr : v.data(); };
  return {arrays.nx.data(),
          arrays.ny.data(),
          arrays.nz.data(),
          arrays.bias.data(),
          arrays.rx.data(),
          arrays.ry.data(),
          arrays.rz.data(),
          arrays.rn.data(),
          arrays.mu.data(),
          drift(arrays.vx),
          drift(arrays.vy),
          drift(arrays.vz),
          arrays.reach.data(),
          record_places(contacts.first.data()),
          record_places(contacts.second.data()),
          contacts.group.data() + range.begin,
          range.begin,
          range.end,
          velocity.size_bytes() > near};
}
ContactView view(const Contacts& contacts, ContactRange range, std::span<const Velocity> velocity,
                 Between between) {
  return view<double>(contacts, contacts, range, velocity, between);
}
SingleContactView view(const Contacts& contacts, const SingleContacts& single, ContactRange range,
                       std::span<const SingleVelocity> velocity, Between between) {
  return view<float>(contacts, single, range, velocity, between);
}

SingleImpulseView impulses(SingleContacts& c) {
  return {c.rx.data(), c.ry.data(), c.rz.data(), c.rn.data()};
}

MomentumView view(const SweepMomentum& m) {
  return {m.steps.x.data(), m.steps.y.data(), m.steps.z.data(), m.steps.n.data(), m.beta, m.omega};
}

ErrorSums sums_of(const ErrorTotals& totals, ContactRange range) {
  ErrorSums sums;
  sums.residual2 = totals.residual2;
  sums.residual_max2 = totals.residual_max2;
  sums.impulse2 = totals.impulse2;
  sums.velocity2 = totals.velocity2;
  sums.work = totals.work;
  std::copy_n(totals.wall_impulse, 3, sums.wall_impulse);
  sums.contacts = static_cast<std::int64_t>(range.end - range.begin);
  sums.active = totals.active;
  return sums;
}

WallView view(WallCopy& wall) {
  return {wall.velocity, wall.inv_mass};
}
static_assert(cell_freedoms == 6, "CellView");
CellView view(CellCopy& cell) {
  return {cell.velocity.data(), cell.inv_mass.data()};
}

/// Half records in lanes of 4 are swept faster than in lanes of 8: 3.5 against 4.2 ns per contact. V afresh
/// takes few registers: 3.0 against 4.1 ns.
LaneKernels in_avx512(const LaneKernels& swept, const LaneKernels& accumulated) {
  LaneKernels kernels = swept;
  kernels.accumulate_grains = accumulated.accumulate_grains;
  kernels.accumulate_wall = accumulated.accumulate_wall;
  return kernels;
}

}  // namespace

SweepKernels::SweepKernels(InstructionSet set)
    : set_(set == InstructionSet::automatic ? best_instruction_set() : set),
      lanes_{&lane_kernels_portable[0], &lane_kernels_portable[1], &lane_kernels_portable[2]} {
  if (!runs_here(set_))
    throw std::invalid_argument("instruction set '" + std::string(name_of(set_)) +
                                "': this processor runs at most '" +
                                std::string(name_of(best_instruction_set())) + "'");
  if (set_ == InstructionSet::portable) return;
  for (std::size_t k = 0; k < std::size(lanes_); ++k) lanes_[k] = &lane_kernels_avx2[k];
  if (set_ == InstructionSet::avx2) return;
  static const LaneKernels avx512[] = {in_avx512(lane_kernels_avx512[0], lane_kernels_avx2[1]),
                                       in_avx512(lane_kernels_avx512[1], lane_kernels_avx2[2])};
  lanes_[1] = &avx512[0];
  lanes_[2] = &avx512[1];
}

template <bool Friction>
void SweepKernels::sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                                ChunkFriction friction) const {
  lanes<Friction>(friction).sweep_grains(view(contacts, range, velocity, Between::grains), impulses(contacts),
                                         records(velocity), friction.mu);
}

template <bool Friction>
void SweepKernels::sweep_grains(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                                ChunkFriction friction, const SweepMomentum& momentum) const {
  lanes<Friction>(friction).momentum_grains(view(contacts, range, velocity, Between::grains),
                                            impulses(contacts), records(velocity), friction.mu,
                                            view(momentum));
}

template <bool Friction>
void SweepKernels::sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                              ChunkFriction friction, WallCopy& wall) const {
  lanes<Friction>(friction).sweep_wall(view(contacts, range, velocity, Between::wall), impulses(contacts),
                                       records(velocity), friction.mu, view(wall));
}

template <bool Friction>
void SweepKernels::sweep_wall(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                              ChunkFriction friction, WallCopy& wall, const SweepMomentum& momentum) const {
  lanes<Friction>(friction).momentum_wall(view(contacts, range, velocity, Between::wall), impulses(contacts),
                                          records(velocity), friction.mu, view(wall), view(momentum));
}

template <bool Friction>
void SweepKernels::sweep_cell(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                              ChunkFriction friction, CellCopy& cell) const {
  lanes<Friction>(friction).sweep_cell(view(contacts, range, velocity, Between::grains), impulses(contacts),
                                       records(velocity), friction.mu, view(cell));
}

template <bool Friction>
void SweepKernels::sweep_cell(Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                              ChunkFriction friction, CellCopy& cell, const SweepMomentum& momentum) const {
  lanes<Friction>(friction).momentum_cell(view(contacts, range, velocity, Between::grains),
                                          impulses(contacts), records(velocity), friction.mu, view(cell),
                                          view(momentum));
}

template <bool Friction>
void SweepKernels::sweep_grains(const Contacts& contacts, SingleState& single, ContactRange range,
                                ChunkFriction friction, const SweepMomentum& momentum) const {
  lanes<Friction>(friction).single_grains(
      view(contacts, single.contacts, range, single.velocity, Between::grains), impulses(single.contacts),
      records(single.velocity), friction.mu, view(momentum));
}

template <bool Friction>
void SweepKernels::sweep_wall(const Contacts& contacts, SingleState& single, ContactRange range,
                              ChunkFriction friction, WallCopy& wall, const SweepMomentum& momentum) const {
  lanes<Friction>(friction).single_wall(
      view(contacts, single.contacts, range, single.velocity, Between::wall), impulses(single.contacts),
      records(single.velocity), friction.mu, {wall.velocity, wall.inv_mass * single.contacts.unit},
      view(momentum));
}

template <bool Friction>
void SweepKernels::sweep_cell(const Contacts& contacts, SingleState& single, ContactRange range,
                              ChunkFriction friction, CellCopy& cell, const SweepMomentum& momentum) const {
  CellVelocity inv_mass = cell.inv_mass;
  for (double& of : inv_mass) of *= single.contacts.unit;
  lanes<Friction>(friction).single_cell(
      view(contacts, single.contacts, range, single.velocity, Between::grains), impulses(single.contacts),
      records(single.velocity), friction.mu, {cell.velocity.data(), inv_mass.data()}, view(momentum));
}

template <bool Friction>
void SweepKernels::accumulate_grains(const Contacts& contacts, ContactRange range,
                                     std::span<Velocity> velocity) const {
  lanes<Friction>(0).accumulate_grains(view(contacts, range, velocity, Between::grains), records(velocity));
}

template <bool Friction>
void SweepKernels::accumulate_wall(const Contacts& contacts, ContactRange range, std::span<Velocity> velocity,
                                   WallCopy& wall) const {
  lanes<Friction>(0).accumulate_wall(view(contacts, range, velocity, Between::wall), records(velocity),
                                     view(wall));
}

template <bool Friction>
ErrorSums SweepKernels::error_grains(const Contacts& contacts, ContactRange range,
                                     std::span<const Velocity> velocity, ChunkFriction friction,
                                     Multiplicities parts) const {
  return sums_of(lanes<Friction>(friction).error_grains(
                     view(contacts, range, velocity, Between::grains), records(velocity), friction.mu,
                     {.wall = nullptr, .wall_inv_mass = 0, .parts = parts.data()}),
                 range);
}

template <bool Friction>
ErrorSums SweepKernels::error_wall(const Contacts& contacts, ContactRange range,
                                   std::span<const Velocity> velocity, ChunkFriction friction,
                                   const WallCopy& wall, Multiplicities parts) const {
  return sums_of(
      lanes<Friction>(friction).error_wall(view(contacts, range, velocity, Between::wall), records(velocity),
                                           friction.mu, {wall.velocity, wall.inv_mass, parts.data()}),
      range);
}

template <bool Friction>
ErrorSums SweepKernels::error_cell(const Contacts& contacts, ContactRange range,
                                   std::span<const Velocity> velocity, ChunkFriction friction,
                                   const CellCopy& cell, Multiplicities parts) const {
  CellVelocity velocity_of_cell = cell.velocity;  // read only
  return sums_of(lanes<Friction>(friction).error_cell(
                     view(contacts, range, velocity, Between::grains), records(velocity), friction.mu,
                     {.wall = nullptr, .wall_inv_mass = 0, .parts = parts.data()},
                     {velocity_of_cell.data(), cell.inv_mass.data()}),
                 range);
}

void SweepKernels::advance(std::span<const Slot> slots, std::span<Velocity> velocity,
                           std::span<Velocity> last, double beta) const {
  lanes_[1]->advance_bodies(records(velocity), records(last), slots.data(), slots.size(), beta);
}

void SweepKernels::advance(std::span<const Slot> slots, std::span<SingleVelocity> velocity,
                           std::span<SingleVelocity> last, double beta) const {
  lanes_[1]->advance_single(records(velocity), records(last), slots.data(), slots.size(), beta);
}

template void SweepKernels::sweep_cell<true>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                             CellCopy&) const;
template void SweepKernels::sweep_cell<true>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                             CellCopy&, const SweepMomentum&) const;
template ErrorSums SweepKernels::error_cell<true>(const Contacts&, ContactRange, std::span<const Velocity>,
                                                  ChunkFriction, const CellCopy&, Multiplicities) const;
template void SweepKernels::sweep_cell<false>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                              CellCopy&) const;
template void SweepKernels::sweep_cell<false>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                              CellCopy&, const SweepMomentum&) const;
template ErrorSums SweepKernels::error_cell<false>(const Contacts&, ContactRange, std::span<const Velocity>,
                                                   ChunkFriction, const CellCopy&, Multiplicities) const;
template void SweepKernels::sweep_grains<true>(const Contacts&, SingleState&, ContactRange, ChunkFriction,
                                               const SweepMomentum&) const;
template void SweepKernels::sweep_wall<true>(const Contacts&, SingleState&, ContactRange, ChunkFriction,
                                             WallCopy&, const SweepMomentum&) const;
template void SweepKernels::sweep_cell<true>(const Contacts&, SingleState&, ContactRange, ChunkFriction,
                                             CellCopy&, const SweepMomentum&) const;
template void SweepKernels::sweep_grains<true>(Contacts&, ContactRange, std::span<Velocity>,
                                               ChunkFriction) const;
template void SweepKernels::sweep_grains<true>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                               const SweepMomentum&) const;
template void SweepKernels::sweep_wall<true>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                             WallCopy&) const;
template void SweepKernels::sweep_wall<true>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                             WallCopy&, const SweepMomentum&) const;
template void SweepKernels::accumulate_grains<true>(const Contacts&, ContactRange, std::span<Velocity>) const;
template void SweepKernels::accumulate_wall<true>(const Contacts&, ContactRange, std::span<Velocity>,
                                                  WallCopy&) const;
template ErrorSums SweepKernels::error_grains<true>(const Contacts&, ContactRange, std::span<const Velocity>,
                                                    ChunkFriction, Multiplicities) const;
template ErrorSums SweepKernels::error_wall<true>(const Contacts&, ContactRange, std::span<const Velocity>,
                                                  ChunkFriction, const WallCopy&, Multiplicities) const;
template void SweepKernels::sweep_grains<false>(const Contacts&, SingleState&, ContactRange, ChunkFriction,
                                                const SweepMomentum&) const;
template void SweepKernels::sweep_wall<false>(const Contacts&, SingleState&, ContactRange, ChunkFriction,
                                              WallCopy&, const SweepMomentum&) const;
template void SweepKernels::sweep_cell<false>(const Contacts&, SingleState&, ContactRange, ChunkFriction,
                                              CellCopy&, const SweepMomentum&) const;
template void SweepKernels::sweep_grains<false>(Contacts&, ContactRange, std::span<Velocity>,
                                                ChunkFriction) const;
template void SweepKernels::sweep_grains<false>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                                const SweepMomentum&) const;
template void SweepKernels::sweep_wall<false>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                              WallCopy&) const;
template void SweepKernels::sweep_wall<false>(Contacts&, ContactRange, std::span<Velocity>, ChunkFriction,
                                              WallCopy&, const SweepMomentum&) const;
template void SweepKernels::accumulate_grains<false>(const Contacts&, ContactRange,
                                                     std::span<Velocity>) const;
template void SweepKernels::accumulate_wall<false>(const Contacts&, ContactRange, std::span<Velocity>,
                                                   WallCopy&) const;
template ErrorSums SweepKernels::error_grains<false>(const Contacts&, ContactRange, std::span<const Velocity>,
                                                     ChunkFriction, Multiplicities) const;
template ErrorSums SweepKernels::error_wall<false>(const Contacts&, ContactRange, std::span<const Velocity>,
                                                   ChunkFriction, const WallCopy&, Multiplicities) const;

}  // namespace talus
