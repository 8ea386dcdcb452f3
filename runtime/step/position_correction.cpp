#include "runtime/step/position_correction.hpp"

#include <algorithm>

namespace talus {

void PositionCorrection::begin() {
  AccelerationHistory& acceleration = work_.lend_acceleration();
  begin_positions(state_.contacts, state_.bodies.velocity, state_.single, acceleration.steps);
  pushes_.resize(state_.candidates.size());
  acceleration.last_wall_v.resize(state_.chunks.size());
  kept_ = state_.copies;
  for (WallCopy& copy : state_.copies) std::fill_n(copy.velocity, 3, 0.0);
}

void PositionCorrection::run(std::size_t chunk, int epoch) {
  const Chunks& chunks = state_.chunks;
  const ContactRange range = work_.range_of(chunk);
  const double part = settings_.overlap_correction;
  SingleState& single = state_.single;
  AccelerationHistory& acceleration = work_.lend_acceleration();
  WallCopy* const copy = chunks.wall[chunk] >= 0 ? &state_.copies[chunk] : nullptr;
  if (epoch == 0) {
    find_overlaps(state_.contacts, chunks, chunk, poses_of(state_), part, single);
    for (std::size_t k = range.begin; k < range.end; ++k) acceleration.steps.n[k] = 0;
    return first_pushes(state_.contacts, range, pushes_, part, single, copy);
  }
  // Momentum begins epochs later, and knows nothing of it.
  if (epoch == 1) lower_pushes(state_.contacts, range, rule_.excess, single, copy);
  const double beta = momentum_beta(rule_.momentum, epoch - 1, rule_.momentum.most_without_friction);
  const SweepMomentum momentum{beta, rule_.momentum.over_relaxation, acceleration.steps};
  carry_velocities(kernels_, beta, work_.owned(chunk), single.velocity, single.last_v);
  if (copy) carry_wall(Carry::momentum, beta, chunk, *copy, acceleration);
  if (chunks.kind[chunk] == ChunkKind::blocks)
    sweep_displacements(state_.contacts, range, single, copy, momentum);
  else if (copy)
    kernels_.sweep_wall<false>(state_.contacts, single, range, 0.0, *copy, momentum);
  else
    kernels_.sweep_grains<false>(state_.contacts, single, range, 0.0, momentum);
  if (epoch == rule_.sweeps) keep_pushes(state_.contacts, chunks, chunk, single, pushes_);
}

void PositionCorrection::end() {
  state_.copies.swap(kept_);
  moved_.swap(kept_);
  end_positions(state_.contacts, state_.single, work_.lend_acceleration().steps);
  found_ = true;
}

void PositionCorrection::move(SlotRange range, std::span<Vec3> x) const {
  if (found_) displace(range, state_.single.velocity, x);
}

}  // namespace talus
