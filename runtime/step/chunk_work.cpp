#include "runtime/step/chunk_work.hpp"

#include <algorithm>

#include "kernels/sweeps/blocks.hpp"
#include "kernels/sweeps/cohesion.hpp"
#include "kernels/sweeps/rolling.hpp"
#include "runtime/graph/clock.hpp"

namespace talus {

namespace {

Carry carry_of(SweepKind kind) {
  return kind == SweepKind::conjugate ? Carry::conjugate : Carry::momentum;
}

}  // namespace

ChunkWork::ChunkWork(StepState& state, const StepParameters& parameters, const SweepKernels& kernels,
                     const EpochSchedule& schedule, const Courses& courses)
    : state_(state), parameters_(parameters), kernels_(kernels), schedule_(schedule), courses_(courses) {}

void ChunkWork::begin(bool damped, bool keep_impulses) {
  keep_impulses_ = keep_impulses;
  before_.resize(damped ? state_.chunks.size() : 0);
  errors_.assign(state_.chunks.size(), {});
  cell_impulses_.assign(state_.domain.repeats ? state_.chunks.size() : 0, {});
}

void ChunkWork::make_room() {
  const Course& course = courses_.now();
  if (course.plan.kind == SweepKind::plain) return;
  const std::size_t bodies = state_.bodies.size(), chunks = state_.chunks.size();
  if (course.single) allocate(state_.single, state_.contacts, bodies);
  allocate(acceleration_, carry_of(course.plan.kind), state_.contacts,
           {course.single ? 0 : bodies, chunks, state_.cell.copies.size()});
  if (course.plan.kind == SweepKind::conjugate) changes_.assign(chunks, 0);
}

void ChunkWork::release_room() {
  const double unit = state_.single.contacts.unit;
  state_.single = {};
  state_.single.contacts.unit = unit;
  acceleration_ = {};
}

ContactRange ChunkWork::range_of(std::size_t c) const {
  const auto begin = static_cast<std::size_t>(state_.chunks.begin[c]);
  return {begin, begin + static_cast<std::size_t>(state_.contacts.count[c])};
}

std::span<const Slot> ChunkWork::owned(std::size_t c) const {
  const auto from = static_cast<std::size_t>(state_.chunks.owned_begin[c]),
             to = static_cast<std::size_t>(state_.chunks.owned_begin[c + 1]);
  return std::span(state_.chunks.owned).subspan(from, to - from);
}

ChunkFriction ChunkWork::friction_of(std::size_t c) const {
  const std::int32_t law = state_.chunks.law[c];
  if (law == mixed_laws) return ChunkFriction::of_each_contact();
  return parameters_.laws.laws()[static_cast<std::size_t>(law)].friction;
}

void ChunkWork::run(std::size_t c, int epoch) {
  const double start = busy_.empty() ? 0 : graph::seconds_now();
  if (parameters_.friction)
    work<true>(c, epoch);
  else
    work<false>(c, epoch);
  if (!busy_.empty()) busy_[c] += graph::seconds_now() - start;
}

std::vector<double> ChunkWork::busy() const {
  std::vector<double> sums(state_.decomposition.here.size(), 0.0);
  for (std::size_t c = 0; c < busy_.size(); ++c)
    sums[static_cast<std::size_t>(state_.chunks.subdomain[c])] += busy_[c];
  return sums;
}

void ChunkWork::restore() {
  for (std::size_t c = 0; c < state_.chunks.size(); ++c)
    restore_impulses(state_.candidates, state_.chunks, c, state_.contacts);
}

template <bool Friction>
void ChunkWork::work(std::size_t c, int epoch) {
  using Work = EpochSchedule::Work;
  switch (schedule_.work(epoch)) {
    case Work::restore:
      restore_impulses(state_.candidates, state_.chunks, c, state_.contacts);
      return accumulate<Friction>(c, epoch);
    case Work::accumulate:
      return accumulate<Friction>(c, epoch);
    case Work::measure:
      return measure<Friction>(c);
    case Work::sweep:
      return sweep<Friction>(c, epoch);
    case Work::position:
      return;  // PositionCorrection does this work
  }
}

template <bool Friction>
void ChunkWork::accumulate(std::size_t c, int epoch) {
  std::span<Velocity> velocity = state_.bodies.velocity;
  const ContactRange range = range_of(c);
  // After single-precision sweeps impulses are in `single`; at the start of a step and after ADMM, in
  // `contacts`.
  const bool from_single = schedule_.work(epoch) == EpochSchedule::Work::accumulate &&
                           !schedule_.opens_segment(epoch) && single(epoch - 1);
  if (from_single) widen_impulses(state_.single.contacts, range, state_.contacts);
  if (courses_.now().plan.kind != SweepKind::plain) {
    if (from_single)
      loosen(owned(c), state_.single.velocity, state_.single.last_v);
    else if (!courses_.now().single)
      loosen(owned(c), state_.bodies.velocity, acceleration_.last_v);
    if (at_wall(c)) loosen(c, state_.copies[c], acceleration_);
    if (stressed(c)) loosen(c, state_.cell.copies[c], acceleration_);
  }
  reset_to_free(owned(c), state_.free, velocity);
  add_moments(state_.contacts, range, state_.bodies.radius, velocity);
  if (stressed(c)) {
    CellCopy& copy = state_.cell.copies[c];
    copy.velocity = cell_impulses_[c] = impulse_on_cell(state_.contacts, range);
    for (std::size_t k = 0; k < cell_freedoms; ++k) copy.velocity[k] *= copy.inv_mass[k];
  }
  if (!at_wall(c)) {
    if (blocks(c)) return accumulate_blocks(state_.contacts, range, velocity, nullptr);
    kernels_.accumulate_grains<Friction>(state_.contacts, range, velocity);
    return pull_together(state_.contacts, range, velocity, nullptr);
  }
  WallCopy& copy = state_.copies[c];
  const Vec3& free = state_.wall_states[static_cast<std::size_t>(state_.chunks.wall[c])].free_velocity;
  std::copy_n(free.data(), 3, copy.velocity);
  if (blocks(c)) return accumulate_blocks(state_.contacts, range, velocity, &copy);
  kernels_.accumulate_wall<Friction>(state_.contacts, range, velocity, copy);
  pull_together(state_.contacts, range, velocity, &copy);
}

template <bool Friction>
void ChunkWork::measure(std::size_t c) {
  const Chunks& chunks = state_.chunks;
  const Contacts& contacts = state_.contacts;
  std::span<const Velocity> velocity = state_.bodies.velocity;
  const Multiplicities parts =
      chunks.side[c] != ChunkSide::inside ? Multiplicities(state_.decomposition.parts) : Multiplicities();
  if (at_wall(c)) {
    WallCopy whole = state_.copies[c];
    whole.inv_mass = state_.walls[static_cast<std::size_t>(chunks.wall[c])].inv_mass();
    errors_[c] = blocks(c) ? error_blocks(contacts, range_of(c), velocity, friction_of(c), &whole, parts)
                           : kernels_.error_wall<Friction>(contacts, range_of(c), velocity, friction_of(c),
                                                           whole, parts);
    Eigen::Map<Vec3>(errors_[c].wall_impulse) -= sum_of_cohesion(contacts, range_of(c));
  } else if (blocks(c)) {
    errors_[c] = error_blocks(contacts, range_of(c), velocity, friction_of(c), nullptr, parts);
  } else if (stressed(c)) {
    const CellCopy whole{state_.cell.copies[c].velocity, state_.cell.inv_mass()};
    errors_[c] = kernels_.error_cell<Friction>(contacts, range_of(c), velocity, friction_of(c), whole, parts);
  } else {
    errors_[c] = kernels_.error_grains<Friction>(contacts, range_of(c), velocity, friction_of(c), parts);
  }
  if (state_.domain.repeats && !at_wall(c) && !stressed(c))
    cell_impulses_[c] = impulse_through_cell(contacts, range_of(c), state_.bodies.radius, state_.cell.length);
  add_error_of_moments(contacts, range_of(c), state_.bodies.radius, velocity, parts, errors_[c]);
  if (keep_impulses_) store_impulses(contacts, chunks, c, state_.candidates);
}

template <bool Friction>
void ChunkWork::sweep(std::size_t c, int epoch) {
  std::span<Velocity> velocity = state_.bodies.velocity;
  Contacts& contacts = state_.contacts;
  WallCopy& copy = state_.copies[c];
  const ContactRange range = range_of(c);
  const Course& course = this->course(epoch);
  const bool wall = at_wall(c), damped = !before_.empty() && state_.chunks.side[c] != ChunkSide::inside;
  const ChunkFriction friction = friction_of(c);
  change_precision(c, epoch);
  if (course.plan.kind != SweepKind::plain) carry_on(c, epoch);
  if (damped) copy_impulses<Friction>(contacts, range, before_[c]);
  if (blocks(c)) {
    sweep_blocks(contacts, range, velocity, friction, wall ? &copy : nullptr);
  } else if (course.plan.kind == SweepKind::momentum) {
    const int sweep = schedule_.sweep(epoch);
    const SweepMomentum momentum{courses_.beta(sweep), courses_.omega(sweep), acceleration_.steps};
    SingleState& single = state_.single;
    if (course.single && stressed(c))
      kernels_.sweep_cell<Friction>(contacts, single, range, friction, state_.cell.copies[c], momentum);
    else if (stressed(c))
      kernels_.sweep_cell<Friction>(contacts, range, velocity, friction, state_.cell.copies[c], momentum);
    else if (course.single && wall)
      kernels_.sweep_wall<Friction>(contacts, single, range, friction, copy, momentum);
    else if (course.single)
      kernels_.sweep_grains<Friction>(contacts, single, range, friction, momentum);
    else if (wall)
      kernels_.sweep_wall<Friction>(contacts, range, velocity, friction, copy, momentum);
    else
      kernels_.sweep_grains<Friction>(contacts, range, velocity, friction, momentum);
  } else if (wall) {
    kernels_.sweep_wall<Friction>(contacts, range, velocity, friction, copy);
  } else if (stressed(c)) {
    kernels_.sweep_cell<Friction>(contacts, range, velocity, friction, state_.cell.copies[c]);
  } else {
    kernels_.sweep_grains<Friction>(contacts, range, velocity, friction);
  }
  sweep_moments(contacts, range, state_.bodies.radius, velocity);
  if (damped)
    relax<Friction>(contacts, range, before_[c], state_.decomposition.multiplicity, velocity,
                    wall ? &copy : nullptr);
  if (course.plan.kind == SweepKind::conjugate)
    changes_[c] = change_squared(range, contacts, velocity, copy.inv_mass, acceleration_);
}

/// Converts a chunk's contacts, and the bodies that it is the first to write, to the precision of the coming
/// sweep. After a check velocities and impulses are in double precision. A course with momentum that goes on
/// through the check changes precision after the first sweep that follows it, and converts its history, too.
void ChunkWork::change_precision(std::size_t c, int epoch) {
  const bool before = single_before(epoch);
  if (course(epoch).single)
    to_single(c, epoch, before);
  else
    to_double(c, epoch, before);
}

void ChunkWork::to_single(std::size_t c, int epoch, bool before) {
  SingleState& single = state_.single;
  const ContactRange range = range_of(c);
  const bool first = schedule_.opens_segment(epoch);
  if (!before) narrow_geometry(state_.contacts, range, single.contacts);
  if (!first && before) return;
  narrow_impulses(state_.contacts, range, single.contacts);
  narrow_bodies(owned(c), state_.bodies.velocity, single);
  if (first) fasten(owned(c), single.velocity, single.last_v);
}

void ChunkWork::to_double(std::size_t c, int epoch, bool before) {
  const SingleState& single = state_.single;
  std::vector<Velocity>& velocity = state_.bodies.velocity;
  const ContactRange range = range_of(c);
  const Course& course = this->course(epoch);
  if (schedule_.opens_segment(epoch)) {
    if (course.plan.kind != SweepKind::plain) fasten(owned(c), velocity, acceleration_.last_v);
    return;
  }
  if (!before) return;
  widen_impulses(single.contacts, range, state_.contacts);
  widen_bodies(owned(c), single.velocity, velocity);
  const bool goes_on = course.plan.kind == SweepKind::momentum && schedule_.sweep(epoch) > course.begun;
  if (!goes_on) return;
  for (const Slot slot : owned(c))
    acceleration_.last_v[static_cast<std::size_t>(slot)] = velocity[static_cast<std::size_t>(slot)];
  widen_bodies(owned(c), single.last_v, acceleration_.last_v);
  widen_steps(single.contacts.unit, range, acceleration_.steps);
}

/// Moves the start of a sweep on along the acceleration: the bodies that this chunk is the first to write,
/// its wall copy, and its impulses. With momentum the sweep itself moves the impulses.
void ChunkWork::carry_on(std::size_t c, int epoch) {
  const Course& course = this->course(epoch);
  const int sweep = schedule_.sweep(epoch);
  const Carry carry = carry_of(course.plan.kind);
  const double beta = courses_.beta(sweep);
  WallCopy& copy = state_.copies[c];
  if (carry == Carry::conjugate)
    carry_impulses(beta, range_of(c), state_.contacts, acceleration_);
  else if (sweep == course.begun)
    begin_steps(range_of(c), acceleration_.steps);
  if (schedule_.opens_segment(epoch) && at_wall(c)) fasten(c, copy, acceleration_);
  if (schedule_.opens_segment(epoch) && stressed(c)) fasten(c, state_.cell.copies[c], acceleration_);
  if (course.single)
    carry_velocities(kernels_, beta, owned(c), state_.single.velocity, state_.single.last_v);
  else
    carry_velocities(kernels_, carry, beta, owned(c), state_.bodies.velocity, acceleration_);
  if (at_wall(c)) carry_wall(carry, beta, c, copy, acceleration_);
  if (stressed(c)) carry_cell(carry, beta, c, state_.cell.copies[c], acceleration_);
}

}  // namespace talus
