/// What the tasks of a step do; their order stands in step_graph.cpp.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "runtime/step/step_graph.hpp"

namespace talus {

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// A few hundred candidates a chunk; fewer in small samples, where colours would otherwise be too thin for
/// threads.
int chunk_target(std::size_t candidates) {
  return static_cast<int>(std::clamp<std::size_t>(candidates / 64, 48, 320));
}

double speed(const Velocity& v) {
  return std::sqrt(v.u[0] * v.u[0] + v.u[1] * v.u[1] + v.u[2] * v.u[2]);
}

std::vector<WallPair> find_wall_pairs(const Bodies& bodies, const std::vector<Wall>& walls,
                                      std::span<const double> reach, std::span<const double> margin) {
  std::vector<WallPair> pairs;
  for (std::size_t w = 0; w < walls.size(); ++w)
    for (std::size_t s = 0; s < bodies.size(); ++s)
      if (walls[w].normal.dot(bodies.x[s] - walls[w].point) < reach[s] + margin[w])
        pairs.push_back({static_cast<std::int32_t>(w), static_cast<Slot>(s)});
  return pairs;
}

}  // namespace

SlotRange StepGraph::share(std::size_t count, std::uint32_t lane) const {
  return {count * lane / lanes_, count * (lane + 1) / lanes_};
}

void StepGraph::predict_lane(std::uint32_t lane) {
  Bodies& bodies = state_.bodies;
  const SlotRange range = share(bodies.size(), lane);
  const double h = parameters_.time_step;
  predict(range, bodies.x, bodies.velocity, h, parameters_.gravity, state_.free);
  if (!bodies.orientation.empty()) turn(range, bodies.orientation, bodies.velocity, bodies.radius, 0.5 * h);
  left_[lane] =
      state_.candidates_valid && left_margin(range, bodies.x, bodies.velocity, bodies.radius, state_.x_then,
                                             state_.reach_then, h, parameters_.alert);
}

/// How near a grain can come to a wall for what the grain's own margin does not count: the wall's way, and
/// what gravity adds to the grain's speed within a step.
double StepGraph::margin_of(const Wall& wall) const {
  const double h = parameters_.time_step;
  return contact_margin(wall.velocity.norm(), h, parameters_.alert) + h * h * parameters_.gravity.norm();
}

bool StepGraph::walls_left_margin() const {
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const Wall& wall = state_.walls[w];
    const double moved = std::abs(wall.normal.dot(wall.point - state_.wall_then[w]));
    if (margin_of(wall) + moved > wall_margin_[w]) return true;
  }
  return false;
}

void StepGraph::make_cells() {
  const double h = parameters_.time_step;
  for (Wall& wall : state_.walls) wall.point += 0.5 * h * wall.velocity;
  sums_.broad_phase = !state_.candidates_valid || walls_left_margin() ||
                      std::any_of(left_.begin(), left_.end(), [](char left) { return left != 0; });
  if (!sums_.broad_phase) return;
  const Bodies& bodies = state_.bodies;
  state_.x_then = bodies.x;
  state_.reach_then.resize(bodies.size());
  const double half_skin = 0.5 * parameters_.skin;
  for (std::size_t s = 0; s < bodies.size(); ++s)
    state_.reach_then[s] =
        bodies.radius[s] + half_skin + contact_margin(speed(bodies.velocity[s]), h, parameters_.alert);
  state_.wall_then.clear();
  wall_margin_.clear();
  for (const Wall& wall : state_.walls) {
    state_.wall_then.push_back(wall.point);
    wall_margin_.push_back(half_skin + margin_of(wall));
  }
  cells_ = build_cells(state_.x_then, state_.reach_then);
}

void StepGraph::find_lane_pairs(std::uint32_t lane) {
  if (!sums_.broad_phase) return;
  pairs_[lane].clear();
  const SlotRange range = share(cells_.cells.size(), lane);
  find_pairs(cells_, state_.x_then, state_.reach_then, range.begin, range.end, pairs_[lane]);
}

void StepGraph::make_chunks() {
  if (!sums_.broad_phase) return;
  cells_ = {};
  Candidates fresh;
  fresh.components = parameters_.friction ? 3 : 1;
  fresh.grain_pairs = sort_pairs(pairs_, state_.bodies.size());
  for (auto& part : pairs_) part = {};
  fresh.wall_pairs = find_wall_pairs(state_.bodies, state_.walls, state_.reach_then, wall_margin_);
  match_impulses(state_.candidates, fresh);
  state_.candidates = std::move(fresh);
  state_.chunks = cut_chunks(state_.candidates, state_.bodies.size(), chunk_target(state_.candidates.size()));
  allocate(state_.contacts, state_.candidates, state_.chunks, parameters_.friction);
  state_.candidates_valid = true;
  planned_ = false;
}

void StepGraph::narrow_lane(std::uint32_t lane) {
  const Bodies& bodies = state_.bodies;
  if (!settings_.warm_start) {
    const auto components = static_cast<std::size_t>(state_.candidates.components);
    const SlotRange own = share(state_.chunks.size(), lane);
    std::fill(state_.candidates.impulse.begin() +
                  static_cast<std::ptrdiff_t>(components) * state_.chunks.begin[own.begin],
              state_.candidates.impulse.begin() +
                  static_cast<std::ptrdiff_t>(components) * state_.chunks.begin[own.end],
              0.0);
  }
  const NarrowPhase in{bodies.x,
                       bodies.radius,
                       bodies.velocity,
                       state_.walls,
                       parameters_.time_step,
                       parameters_.alert,
                       parameters_.law.restitution,
                       parameters_.gravity,
                       settings_.overlap_correction};
  const SlotRange range = share(state_.chunks.size(), lane);
  for (std::size_t c = range.begin; c < range.end; ++c)
    narrow_chunk(in, state_.candidates, state_.chunks, c, state_.contacts);
}

void StepGraph::plan_iteration() {
  reset_to_free(state_.chunks.untouched, state_.free, state_.bodies.velocity);
  iteration_.begin();
  if (!planned_ || planned_walls_ != iteration_.glued_walls()) plan_epochs();
  iterating_ = now();
}

/// Chunks as they conflict, and behind them one node per glued wall that conflicts with its copies and has a
/// colour of its own, the last.
void StepGraph::plan_epochs() {
  const Chunks& chunks = state_.chunks;
  const std::size_t count = chunks.size();
  planned_walls_ = iteration_.glued_walls();
  const std::size_t nodes = count + planned_walls_.size();
  std::vector<std::vector<std::uint32_t>> glue_of(count);
  for (std::size_t g = 0; g < planned_walls_.size(); ++g)
    for (std::size_t c = 0; c < count; ++c)
      if (chunks.wall[c] == planned_walls_[g]) glue_of[c].push_back(static_cast<std::uint32_t>(count + g));

  std::vector<std::uint32_t> colour(nodes, static_cast<std::uint32_t>(chunks.colours)), offset(1, 0),
      neighbour;
  for (std::size_t c = 0; c < count; ++c) {
    colour[c] = static_cast<std::uint32_t>(chunks.colour[c]);
    neighbour.insert(neighbour.end(), chunks.conflicts.begin() + chunks.conflict_begin[c],
                     chunks.conflicts.begin() + chunks.conflict_begin[c + 1]);
    neighbour.insert(neighbour.end(), glue_of[c].begin(), glue_of[c].end());
    offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
  }
  for (std::int32_t wall : planned_walls_) {
    for (std::size_t c = 0; c < count; ++c)
      if (chunks.wall[c] == wall) neighbour.push_back(static_cast<std::uint32_t>(c));
    offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
  }

  // Bodies stand in Morton order, so the first body of a chunk says where it lies; walls' chunks go to
  // whoever sweeps the grains beside them.
  std::vector<std::uint32_t> order(count), weight(count), owner_in_order(count), owner(nodes, 0);
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](std::uint32_t c) {
    return chunks.bodies[static_cast<std::size_t>(chunks.body_begin[c])];
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
  for (std::size_t k = 0; k < count; ++k)
    weight[k] = 1 + static_cast<std::uint32_t>(state_.contacts.count[order[k]]);
  graph::assign_owners(weight, executor_.threads(), owner_in_order);
  for (std::size_t k = 0; k < count; ++k) owner[order[k]] = owner_in_order[k];
  epochs_.build({colour, offset, neighbour}, owner, executor_.threads());
  planned_ = true;
}

void StepGraph::finish_lane(std::uint32_t lane) {
  Bodies& bodies = state_.bodies;
  const SlotRange range = share(bodies.size(), lane);
  motion_[lane] = finish(range, bodies.x, bodies.velocity, parameters_.time_step, state_.free);
  if (!bodies.orientation.empty())
    turn(range, bodies.orientation, bodies.velocity, bodies.radius, 0.5 * parameters_.time_step);
}

void StepGraph::finish_walls() {
  iterated_ = now();
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const WallState& wall = state_.wall_states[w];
    Vec3 velocity = wall.free_velocity;
    if (!wall.copies.empty())
      velocity =
          Eigen::Map<const Vec3>(state_.copies[static_cast<std::size_t>(wall.copies.front())].velocity);
    state_.walls[w].velocity = velocity;
    state_.walls[w].point += 0.5 * parameters_.time_step * velocity;
  }
}

void StepGraph::measure_lane(std::uint32_t lane) {
  const SlotRange range = share(state_.chunks.size(), lane);
  contact_sums_[lane] = {};
  for (std::size_t c = range.begin; c < range.end; ++c) {
    store_impulses(state_.contacts, state_.chunks, c, state_.candidates);
    contact_sums_[lane].add(measure_contacts(state_.contacts, state_.chunks, c, state_.bodies.x,
                                             state_.bodies.radius, state_.walls));
  }
}

void StepGraph::sum_up() {
  for (std::uint32_t lane = 0; lane < lanes_; ++lane) {
    sums_.motion.add(motion_[lane]);
    sums_.contacts.add(contact_sums_[lane]);
  }
  sums_.times = {iterating_ - started_, iterated_ - iterating_, now() - iterated_};
}

}  // namespace talus
