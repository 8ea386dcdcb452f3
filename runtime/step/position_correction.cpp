#include "runtime/step/position_correction.hpp"

#include <algorithm>

#include "kernels/shapes/clump_motion.hpp"

namespace talus {

namespace {

/// Moves a wall from the middle of the step to its end. `copy`: null where this rank has none, and nothing
/// that touches it.
void move_on(const WallState& state, const WallCopy* copy, const StepParameters& parameters, Wall& wall) {
  if (!wall.motion.empty()) {
    if (wall.surface() != nullptr) {
      wall.pose = state.end;
    } else {
      wall.point = state.end.of(state.middle.back(wall.point));
      wall.normal = state.end.turn * (state.middle.turn.transpose() * wall.normal);
    }
    return;
  }
  Vec3 velocity = wall.velocity;
  if (copy != nullptr) {
    velocity = Eigen::Map<const Vec3>(copy->velocity);
    velocity += parameters.reflection * (velocity - wall.velocity);
  }
  wall.point += 0.5 * parameters.time_step * velocity;
}

}  // namespace

void PositionCorrection::find_end_of_step() {
  const Bodies& bodies = state_.bodies;
  const SlotRange all{0, bodies.size()};
  ends_.x.resize(bodies.size());
  if (!bodies.shape.empty()) ends_.velocity.resize(bodies.size());
  find_ends(all, bodies, state_.free, finish_of(state_, parameters_), ends_);
  if (!bodies.shape.empty()) {
    ends_.shape = bodies.shape;
    ends_.radius = bodies.radius;
    ends_.orientation = bodies.orientation;
    turn_clumps(all, ends_, state_.clumps, 0.5 * parameters_.time_step);
  }
  walls_ = state_.walls;
  for (std::size_t w = 0; w < walls_.size(); ++w) {
    const WallState& wall = state_.wall_states[w];
    move_on(wall, wall.copies.empty() ? nullptr : &state_.copies[wall.copies.front().at()], parameters_,
            walls_[w]);
  }
  domain_ = state_.domain;
  if (domain_.flows) end_flow(state_.flow, domain_);
}

void PositionCorrection::begin() {
  AccelerationHistory& acceleration = work_.lend_acceleration();
  begin_positions(state_.contacts, state_.bodies.velocity, state_.single, acceleration.steps);
  pushes_.resize(state_.candidates.size());
  acceleration.last_wall_v.resize(state_.chunks.size());
  find_end_of_step();
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
    find_overlaps(state_.contacts, chunks, chunk,
                  {ends_.x, state_.bodies.radius, walls_, clumps_of(state_, ends_), domain_}, part, single);
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
