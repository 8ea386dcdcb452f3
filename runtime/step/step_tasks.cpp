/// What the tasks of a step do; their order stands in step_graph.cpp.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "kernels/narrow_phase.hpp"
#include "kernels/release.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/graph/loop_colours.hpp"
#include "runtime/graph/tree.hpp"
#include "runtime/step/step_graph.hpp"
#include "runtime/step/task_kinds.hpp"
#include "runtime/trace/order.hpp"

namespace talus {

namespace {

double speed(const Velocity& v) {
  return std::sqrt(v.u[0] * v.u[0] + v.u[1] * v.u[1] + v.u[2] * v.u[2]);
}

std::vector<WallPair> find_wall_pairs(std::span<const Vec3> x, const std::vector<Wall>& walls,
                                      std::span<const double> reach, std::span<const double> margin) {
  std::vector<WallPair> pairs;
  for (std::size_t w = 0; w < walls.size(); ++w)
    for (std::size_t s = 0; s < x.size(); ++s)
      if (walls[w].normal.dot(x[s] - walls[w].point) < reach[s] + margin[w])
        pairs.push_back({static_cast<std::int32_t>(w), static_cast<Slot>(s)});
  return pairs;
}

/// Where nothing is told, chunks at glued walls are of the border.
graph::ChunkTurn::Side side_of(ChunkSide side, bool tells) {
  using enum graph::ChunkTurn::Side;
  switch (side) {
    case ChunkSide::wall:
      return tells ? early : border;
    case ChunkSide::border:
      return border;
    case ChunkSide::inside:
      return inside;
    case ChunkSide::late:
      break;
  }
  return late;
}

}  // namespace

SlotRange StepGraph::share(std::size_t count, std::uint32_t lane) const {
  return {count * lane / lanes_, count * (lane + 1) / lanes_};
}

/// Slots of a lane: a share of one subdomain.
SlotRange StepGraph::slots(std::uint32_t lane) const {
  const std::size_t e = lane / lanes_per_subdomain_, part = lane % lanes_per_subdomain_;
  const Decomposition& all = state_.decomposition;
  const std::size_t begin = all.several() ? all.slot_begin[e] : 0;
  const std::size_t count = all.several() ? all.slot_begin[e + 1] - begin : state_.bodies.size();
  return {begin + count * part / lanes_per_subdomain_, begin + count * (part + 1) / lanes_per_subdomain_};
}

bool StepGraph::partition_due() const {
  return steps_ - partitioned_ >= decomposition_.repartition_every || out_of_balance();
}

/// Not where it has not been much less since the last cut: the sample may not be divisible any better; nor
/// where contacts are so few that their places are chance. What was cut before there were candidates is cut
/// again when there are.
bool StepGraph::out_of_balance() const {
  constexpr std::int64_t few = 16;
  if (!state_.decomposition.several()) return false;
  const std::int64_t contacts = iteration_.result().contacts;
  if (state_.decomposition.blind && contacts > 0) return true;
  const double imbalance = iteration_.imbalance();
  return contacts > few * state_.decomposition.partition.subdomains &&
         imbalance > decomposition_.max_imbalance && imbalance > 1.25 * imbalance_then_;
}

/// Per subdomain here, in candidates: those it has, and what its interface takes besides
/// (docs/performance.md, "Scaling, predicted"). The same on any ranks.
std::vector<double> StepGraph::work() const {
  constexpr double wall = 1,  // more than between grains
      copy = 1.3,             // to send one and to take one
      neighbour = 100;        // a message sent and one taken, 0.3 us each
  std::vector<double> work;
  for (const SubdomainInterface& interface : state_.decomposition.interfaces)
    work.push_back(copy * static_cast<double>(interface.exchange.size()) +
                   neighbour * static_cast<double>(interface.neighbours.size()));
  const Chunks& chunks = state_.chunks;
  for (std::size_t c = 0; c < chunks.size(); ++c)
    work[static_cast<std::size_t>(chunks.subdomain[c])] +=
        (chunks.wall[c] < 0 ? 1 : 1 + wall) * (chunks.begin[c + 1] - chunks.begin[c]);
  return work;
}

/// Per subdomain: the work of a candidate over the mean, from the work of those here. Collective.
std::vector<double> StepGraph::costs(std::span<const double> work) const {
  struct Row {
    double subdomain, work, candidates;
  };
  const Decomposition& all = state_.decomposition;
  std::vector<Row> rows;
  for (std::size_t e = 0; e < all.here.size(); ++e)
    rows.push_back({static_cast<double>(all.here[e]), work[e], 0});
  for (std::size_t c = 0; c < state_.chunks.size(); ++c)
    rows[static_cast<std::size_t>(state_.chunks.subdomain[c])].candidates +=
        state_.chunks.begin[c + 1] - state_.chunks.begin[c];
  rows = ranks_.gather_records(std::span<const Row>(rows));
  // In order of subdomain: the same sums on any ranks.
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.subdomain < b.subdomain; });
  double sum = 0, candidates = 0;
  for (const Row& row : rows) {
    sum += row.work;
    candidates += row.candidates;
  }
  if (sum == 0 || candidates == 0) return {};
  std::vector<double> cost(static_cast<std::size_t>(all.partition.subdomains), 1.0);
  for (const Row& row : rows)
    if (row.candidates > 0)
      cost[static_cast<std::size_t>(row.subdomain)] = row.work / row.candidates * (candidates / sum);
  return cost;
}

void StepGraph::predict_lane(std::uint32_t lane) {
  Bodies& bodies = state_.bodies;
  const SlotRange range = slots(lane);
  const double h = parameters_.time_step;
  predict(range, bodies.x, bodies.velocity, h);
  free_velocities(range, bodies.velocity, h, parameters_.gravity, state_.free);
  if (!bodies.orientation.empty()) turn(range, bodies.orientation, bodies.velocity, bodies.radius, 0.5 * h);
  left_[lane].clear();
  if (state_.candidates_valid)
    find_leavers(range, bodies, {state_.x_then, state_.reach_then, h, parameters_.alert}, left_[lane]);
}

/// How near a grain can come to a wall for what the grain's own margin does not count: the wall's way, and
/// what gravity adds to the grain's speed within a step, and the wall's load to its own.
double StepGraph::margin_of(const Wall& wall) const {
  const double h = parameters_.time_step;
  return contact_margin(wall.velocity.norm(), h, parameters_.alert) +
         h * (h * parameters_.gravity.norm() + wall.gain.norm());
}

bool StepGraph::walls_left_margin() const {
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    const Wall& wall = state_.walls[w];
    const double moved = std::abs(wall.normal.dot(wall.point - state_.wall_then[w]));
    if (margin_of(wall) + moved > wall_margin_[w]) return true;
  }
  return false;
}

bool StepGraph::needs_broad_phase() {
  const bool left = std::any_of(left_.begin(), left_.end(), [](const auto& lane) { return !lane.empty(); });
  double needed[2] = {!state_.candidates_valid || walls_left_margin() || out_of_balance() ? 1.0 : 0.0,
                      left ? 1.0 : 0.0};
  ranks_.max(needed);
  return needed[0] > 0 || (needed[1] > 0 && !candidates_hold());
}

/// Whether the grains that left their margins, few of them, meet none but their candidates. Collective; the
/// same for any ranks, since the grains and their candidates are put together from all of them.
bool StepGraph::candidates_hold() const {
  constexpr std::size_t few = 32;  // comparing them costs little beside a broad phase
  std::vector<Leaver> leavers;
  for (const auto& lane : left_) leavers.insert(leavers.end(), lane.begin(), lane.end());
  leavers = ranks_.gather_records(std::span<const Leaver>(leavers));
  std::sort(leavers.begin(), leavers.end());  // copies side by side, whichever rank comes first
  leavers.erase(std::unique(leavers.begin(), leavers.end(),
                            [](const Leaver& a, const Leaver& b) { return a.id == b.id; }),
                leavers.end());
  if (leavers.size() > few) return false;
  for (const Leaver& leaver : leavers) {
    if (!std::isfinite(leaver.need + leaver.x[0] + leaver.x[1] + leaver.x[2])) return false;  // a runaway
    // It may have passed a grain that it is beyond by now, and that only a candidate would tell of.
    const double speed = std::hypot(leaver.u[0], leaver.u[1], leaver.u[2]);
    if (parameters_.time_step * speed > 0.5 * leaver.radius) return false;
  }
  std::vector<Encounter> needed, known;
  compare_leavers(leavers, state_.bodies, state_.candidates,
                  {state_.x_then, state_.reach_then, parameters_.time_step, parameters_.alert,
                   parameters_.gravity, state_.walls},
                  needed, known);
  return all_known(ranks_.gather_records(std::span<const Encounter>(needed)),
                   ranks_.gather_records(std::span<const Encounter>(known)));
}

void StepGraph::make_cells() {
  const double h = parameters_.time_step;
  for (Wall& wall : state_.walls) wall.point += 0.5 * h * wall.velocity;
  if (steps_ == partitioned_ + 1 || iteration_.imbalance() < imbalance_then_)
    imbalance_then_ = iteration_.imbalance();
  sums_.broad_phase = needs_broad_phase();
  if (!sums_.broad_phase) return;
  Bodies& bodies = state_.bodies;
  std::vector<double> reach(bodies.size());
  const double half_skin = 0.5 * parameters_.skin;
  // Grains that fly between others use up half a skin at once: they get one more, or their way
  // of three steps.
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    const double v = speed(bodies.velocity[s]);
    reach[s] = bodies.radius[s] + half_skin + contact_margin(v, h, parameters_.alert) +
               std::min(3 * h * v, parameters_.skin);
  }
  state_.wall_then.clear();
  wall_margin_.clear();
  for (const Wall& wall : state_.walls) {
    state_.wall_then.push_back(wall.point);
    wall_margin_.push_back(half_skin + margin_of(wall));
  }
  // What the last step found is in the impulses of the candidates; detection works in its room.
  const auto make_room = [this] {
    state_.contacts = {};
    state_.chunks = {};
  };
  if (state_.decomposition.several()) {
    const bool first = state_.decomposition.interfaces.empty();
    const bool anew = first || partition_due();
    if (anew) {
      partitioned_ = steps_;
      if (!first && decomposition_.balance != BalanceBy::contacts)
        state_.decomposition.cost =
            costs(decomposition_.balance == BalanceBy::time ? iteration_.busy() : work());
    }
    make_room();
    const double began = graph::seconds_now();
    trace::Span span(executor_.trace(), kind_of(TaskKind::partition));
    around_ = collect_surroundings(state_.decomposition, decomposition_, ranks_, bodies, reach,
                                   state_.candidates, anew);
    span.end();
    sums_.times.dealing = graph::seconds_now() - began;
    cells_ = build_cells(around_.bodies.x, around_.reach);
    return;
  }
  make_room();
  state_.x_then = bodies.x;
  state_.reach_then = std::move(reach);
  cells_ = build_cells(state_.x_then, state_.reach_then);
}

void StepGraph::find_lane_pairs(std::uint32_t lane) {
  if (!sums_.broad_phase) return;
  pairs_[lane].clear();
  const SlotRange range = share(cells_.cells.size(), lane);
  find_pairs(cells_, range.begin, range.end, pairs_[lane]);
}

void StepGraph::make_chunks() {
  if (!sums_.broad_phase) return;
  cells_ = {};
  const bool several = state_.decomposition.several();
  Candidates fresh;
  fresh.components = parameters_.friction ? 3 : 1;
  fresh.grain_pairs = sort_pairs(pairs_, several ? around_.bodies.size() : state_.bodies.size());
  for (auto& part : pairs_) release(part);
  fresh.wall_pairs = find_wall_pairs(several ? around_.bodies.x : state_.bodies.x, state_.walls,
                                     several ? around_.reach : state_.reach_then, wall_margin_);
  std::vector<char> glued;
  for (const Wall& wall : state_.walls) glued.push_back(wall.inv_mass() > 0 ? 1 : 0);
  std::vector<CandidateGroup> groups;
  const double began = graph::seconds_now();
  if (several) {
    const trace::Span span(executor_.trace(), kind_of(TaskKind::partition));
    groups = distribute(state_.decomposition, decomposition_, ranks_, around_, std::move(fresh), glued,
                        state_.bodies, state_.candidates);
    sums_.migrants = state_.decomposition.migrants;
    renew_slots();
    sums_.times.dealing += graph::seconds_now() - began;
  } else {
    match_impulses(state_.candidates, fresh);
    state_.candidates = std::move(fresh);
    const auto all = static_cast<std::int64_t>(state_.candidates.size());
    groups = groups_of_one_subdomain(state_.candidates, glued, chunk_target(all, all));
  }
  state_.chunks = cut_chunks(state_.candidates, groups, state_.bodies.size(), state_.decomposition.taken);
  allocate(state_.contacts, state_.candidates, state_.chunks, parameters_.friction);
  const double planning = graph::seconds_now();
  iteration_.plan();
  if (several) sums_.times.dealing += graph::seconds_now() - planning;
  std::int64_t candidates[1] = {static_cast<std::int64_t>(state_.candidates.size())};
  ranks_.sum(candidates);
  all_candidates_ = candidates[0];
  state_.candidates_valid = true;
  planned_ = false;
}

/// What is kept per slot follows the copies to their new places.
void StepGraph::renew_slots() {
  const Bodies& bodies = state_.bodies;
  const double h = parameters_.time_step;
  state_.x_then = bodies.x;
  state_.reach_then.clear();
  for (const SubdomainInterface& interface : state_.decomposition.interfaces)
    for (Slot body : interface.bodies)
      state_.reach_then.push_back(around_.reach[static_cast<std::size_t>(body)]);
  around_ = {};
  state_.free.u.resize(bodies.size());
  state_.free.w.resize(parameters_.turns ? bodies.size() : 0);
  free_velocities({0, bodies.size()}, bodies.velocity, h, parameters_.gravity, state_.free);
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
    narrow_chunk(in, state_.candidates, state_.chunks, c, iteration_.kernels(), state_.contacts);
}

void StepGraph::plan_iteration() {
  reset_to_free(state_.chunks.untouched, state_.free, state_.bodies.velocity);
  if (!planned_) {
    const double planning = graph::seconds_now();
    iteration_.plan_tree();
    if (state_.decomposition.several()) sums_.times.dealing += graph::seconds_now() - planning;
  }
  iteration_.begin();
  if (!planned_) plan_epochs();
  followed_ = order_ && order_->begin_step(static_cast<std::uint32_t>(steps_));
  iterating_ = graph::seconds_now();
}

/// Chunks as they conflict; and, where copies are glued, tell[e] behind the chunks of e at glued walls,
/// publish[e] behind those at its border, too, the centre and, where the tree has one, collect behind tells,
/// glue[e] last; of those e whose turn is not the first take[e] before the border (iteration.hpp).
void StepGraph::plan_epochs() {
  const Chunks& chunks = state_.chunks;
  const Gluing& gluing = iteration_.gluing();
  const std::size_t count = chunks.size(), here = state_.decomposition.here.size();
  const std::size_t of_rank = gluing.tasks_of_rank(), followers = gluing.followers().size(),
                    nodes = count +
                            (gluing.needed() ? 2 * here + of_rank + followers + gluing.tellers().size() : 0);
  const auto publish = [&](std::size_t e) { return static_cast<std::uint32_t>(count + e); };
  const auto centre = static_cast<std::uint32_t>(count + here + of_rank - 1);
  const auto glue = [&](std::size_t e) { return static_cast<std::uint32_t>(count + here + of_rank + e); };
  std::vector<char> turn;
  for (std::size_t e = 0; e < here; ++e) turn.push_back(static_cast<char>(gluing.turn(e)));
  std::vector<std::uint32_t> take(here, 0), tell(here, 0);
  std::vector<char> tells(here, 0);
  auto next = static_cast<std::uint32_t>(count + 2 * here + of_rank);
  for (const std::uint32_t e : gluing.followers()) take[e] = next++;
  for (const std::uint32_t e : gluing.tellers()) {
    tell[e] = next++;
    tells[e] = 1;
  }
  const auto reading = [&](std::size_t reader, std::size_t from) {
    return gluing.reads_early(reader, from) ? take[reader] : glue(reader);
  };

  std::vector<std::uint32_t> colour(nodes), offset(1, 0), neighbour;
  std::vector<std::vector<std::uint32_t>> boundary(here), at_walls(here);
  // The tree of ranks has its part among chunks, so that the way there and the way back are both hidden. It
  // touches what walls' chunks have written and glue will read: before or behind others the bits are the
  // same.
  std::vector<graph::ChunkTurn> turns;
  for (std::size_t c = 0; c < count; ++c)
    turns.push_back({side_of(chunks.side[c], tells[static_cast<std::size_t>(chunks.subdomain[c])] != 0),
                     static_cast<std::uint32_t>(chunks.subdomain[c]),
                     static_cast<std::uint32_t>(chunks.colour[c])});
  const graph::LoopColours colours =
      graph::loop_colours(turns, turn, tells, state_.decomposition.in_turns(), decomposition_.overlap,
                          executor_.threads(), ranks_.rank(), gluing.tree());
  std::copy(colours.chunk.begin(), colours.chunk.end(), colour.begin());
  for (std::size_t c = 0; c < count; ++c) {
    const auto e = static_cast<std::size_t>(chunks.subdomain[c]);
    const bool at_interface = gluing.needed() && chunks.side[c] != ChunkSide::inside;
    neighbour.insert(neighbour.end(), chunks.conflicts.begin() + chunks.conflict_begin[c],
                     chunks.conflicts.begin() + chunks.conflict_begin[c + 1]);
    if (at_interface) {
      neighbour.push_back(publish(e));
      neighbour.push_back(glue(e));
      if (turn[e] > 0) neighbour.push_back(take[e]);
      boundary[e].push_back(static_cast<std::uint32_t>(c));
      if (tells[e] != 0 && chunks.side[c] == ChunkSide::wall) {
        neighbour.push_back(tell[e]);
        at_walls[e].push_back(static_cast<std::uint32_t>(c));
      }
    }
    offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
  }
  const auto to_centre = [&] {
    for (auto task = static_cast<std::uint32_t>(count + here); task <= centre; ++task)
      neighbour.push_back(task);
  };
  const auto from_subdomains = [&] {
    for (std::size_t e = 0; e < here; ++e)
      if (tells[e] != 0)
        neighbour.push_back(tell[e]);
      else if (turn[e] == 0)
        neighbour.push_back(publish(e));
  };
  if (gluing.needed()) {
    for (std::size_t e = 0; e < here; ++e) {
      colour[publish(e)] = colours.publish[e];
      neighbour.insert(neighbour.end(), boundary[e].begin(), boundary[e].end());
      if (tells[e] == 0 && turn[e] == 0) to_centre();
      neighbour.push_back(glue(e));
      if (turn[e] > 0) neighbour.push_back(take[e]);
      for (std::uint32_t reader : gluing.readers_here(e)) neighbour.push_back(reading(reader, e));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    if (of_rank > 1) {
      colour[count + here] = colours.tree.up;
      from_subdomains();
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    colour[centre] = colours.tree.down;
    from_subdomains();
    for (std::size_t e = 0; e < here; ++e) neighbour.push_back(glue(e));
    offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    for (std::size_t e = 0; e < here; ++e) {
      colour[glue(e)] = colours.glue;
      neighbour.insert(neighbour.end(), boundary[e].begin(), boundary[e].end());
      neighbour.push_back(centre);
      neighbour.push_back(publish(e));
      if (turn[e] > 0) neighbour.push_back(take[e]);
      if (tells[e] != 0) neighbour.push_back(tell[e]);
      for (std::uint32_t writer : gluing.readers_here(e))
        if (!gluing.reads_early(e, writer)) neighbour.push_back(publish(writer));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    for (const std::uint32_t e : gluing.followers()) {
      colour[take[e]] = colours.take[e];
      neighbour.insert(neighbour.end(), boundary[e].begin(), boundary[e].end());
      neighbour.push_back(publish(e));
      neighbour.push_back(glue(e));
      for (std::uint32_t writer : gluing.readers_here(e))
        if (gluing.reads_early(e, writer)) neighbour.push_back(publish(writer));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    for (const std::uint32_t e : gluing.tellers()) {
      colour[tell[e]] = colours.tell[e];
      neighbour.insert(neighbour.end(), at_walls[e].begin(), at_walls[e].end());
      to_centre();
      neighbour.push_back(glue(e));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
  }

  // Bodies stand in Morton order, subdomain after subdomain, so the first body of a chunk says where it lies;
  // walls' chunks go to whoever sweeps the grains beside them, and a subdomain's gluing to who has its first
  // chunk.
  std::vector<std::uint32_t> order(count), weight(count), subdomain(count), owner_in_order(count),
      owner(nodes, 0);
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](std::uint32_t c) {
    return chunks.bodies[static_cast<std::size_t>(chunks.body_begin[c])];
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
  for (std::size_t k = 0; k < count; ++k) {
    weight[k] = 1 + static_cast<std::uint32_t>(state_.contacts.count[order[k]]);
    subdomain[k] = static_cast<std::uint32_t>(chunks.subdomain[order[k]]);
  }
  graph::assign_owners(weight, subdomain, executor_.threads(), owner_in_order);
  for (std::size_t k = count; k-- > 0;) {
    owner[order[k]] = owner_in_order[k];
    if (!gluing.needed() || (ranks_.ranks() > 1 && !ranks_.any_thread())) continue;
    const auto e = static_cast<std::size_t>(chunks.subdomain[order[k]]);
    owner[publish(e)] = owner[glue(e)] = owner_in_order[k];
    if (turn[e] > 0) owner[take[e]] = owner_in_order[k];
    if (tells[e] != 0) owner[tell[e]] = owner_in_order[k];
  }
  epochs_.build({colour, offset, neighbour}, owner, executor_.threads());
  if (executor_.trace() || executor_.times() || order_) note_plan({colour, offset, neighbour}, owner);
  planned_ = true;
}

void StepGraph::finish_lane(std::uint32_t lane) {
  Bodies& bodies = state_.bodies;
  const SlotRange range = slots(lane);
  const Decomposition& all = state_.decomposition;
  const bool uneven = decomposition_.coupling != Coupling::nscdd;
  motion_[lane] = finish(range, bodies.x, bodies.velocity, parameters_.time_step, state_.free,
                         uneven ? Multiplicities(all.multiplicity) : Multiplicities(),
                         uneven ? Multiplicities(all.parts) : Multiplicities());
  if (!bodies.orientation.empty())
    turn(range, bodies.orientation, bodies.velocity, bodies.radius, 0.5 * parameters_.time_step);
}

void StepGraph::finish_walls() {
  iterated_ = graph::seconds_now();
  // A wall without a copy here has its velocity from the ranks that hold one, or its free one.
  const std::size_t walls = state_.walls.size();
  std::vector<double> velocities(3 * walls, -std::numeric_limits<double>::infinity());
  for (std::size_t w = 0; w < walls; ++w) {
    const WallState& wall = state_.wall_states[w];
    const double* copy = wall.free_velocity.data();
    if (!wall.copies.empty())
      copy = state_.copies[static_cast<std::size_t>(wall.copies.front())].velocity;
    else if (wall.copies_everywhere > 0)
      continue;
    std::copy_n(copy, 3, &velocities[3 * w]);
  }
  ranks_.max(velocities);
  for (std::size_t w = 0; w < walls; ++w) {
    state_.walls[w].velocity = Eigen::Map<const Vec3>(&velocities[3 * w]);
    state_.walls[w].point += 0.5 * parameters_.time_step * state_.walls[w].velocity;
  }
  contact_sums_.resize(state_.chunks.size());
}

void StepGraph::measure_lane(std::uint32_t lane) {
  const SlotRange range = share(state_.chunks.size(), lane);
  for (std::size_t c = range.begin; c < range.end; ++c) {
    store_impulses(state_.contacts, state_.chunks, c, state_.candidates);
    contact_sums_[c] = measure_contacts(state_.contacts, state_.chunks, c, state_.bodies.x,
                                        state_.bodies.radius, state_.walls);
  }
}

namespace {

/// What a subdomain adds to the report, as numbers that travel.
constexpr std::size_t row_width = 1 + 9 + 14;

void write_row(std::int32_t subdomain, const MotionSums& motion, const ContactSums& contacts, double* row) {
  const double head[] = {static_cast<double>(subdomain),
                         motion.energy.translation,
                         motion.energy.rotation,
                         motion.energy_free,
                         motion.impulse[0],
                         motion.impulse[1],
                         motion.impulse[2],
                         motion.impulse_scale,
                         motion.speed2_max,
                         static_cast<double>(motion.fastest),
                         static_cast<double>(contacts.overlapping),
                         contacts.penetration,
                         contacts.penetration_max,
                         contacts.normal_impulse,
                         static_cast<double>(contacts.passed)};
  row = std::copy(std::begin(head), std::end(head), row);
  std::copy_n(contacts.moment.data(), 9, row);
}

void add_row(const double* row, bool here, StepSums& sums) {
  MotionSums motion;
  motion.energy = {row[1], row[2]};
  motion.energy_free = row[3];
  motion.impulse = {row[4], row[5], row[6]};
  motion.impulse_scale = row[7];
  motion.speed2_max = row[8];
  motion.fastest = here ? static_cast<Slot>(row[9]) : -1;
  sums.motion.add(motion);
  ContactSums contacts;
  contacts.overlapping = static_cast<std::int64_t>(row[10]);
  contacts.penetration = row[11];
  contacts.penetration_max = row[12];
  contacts.normal_impulse = row[13];
  contacts.passed = static_cast<std::int64_t>(row[14]);
  contacts.moment = Eigen::Map<const Eigen::Matrix3d>(row + 15);
  sums.contacts.add(contacts);
}

}  // namespace

void StepGraph::sum_up() {
  const Decomposition& all = state_.decomposition;
  std::vector<MotionSums> motion(all.here.size());
  std::vector<ContactSums> contacts(all.here.size());
  for (std::uint32_t lane = 0; lane < lanes_; ++lane) motion[lane / lanes_per_subdomain_].add(motion_[lane]);
  for (std::size_t c = 0; c < contact_sums_.size(); ++c)
    contacts[static_cast<std::size_t>(state_.chunks.subdomain[c])].add(contact_sums_[c]);
  std::vector<double> rows(all.here.size() * row_width);
  for (std::size_t e = 0; e < all.here.size(); ++e)
    write_row(all.here[e], motion[e], contacts[e], &rows[e * row_width]);
  rows = ranks_.gather_records(std::span<const double>(rows));
  std::vector<const double*> by_subdomain(static_cast<std::size_t>(all.partition.subdomains));
  for (std::size_t k = 0; k < rows.size(); k += row_width)
    by_subdomain[static_cast<std::size_t>(rows[k])] = &rows[k];
  for (std::size_t e = 0; e < by_subdomain.size(); ++e)
    add_row(by_subdomain[e], all.rank_of[e] == ranks_.rank(), sums_);
  sums_.candidates = all_candidates_;
  sums_.times.detection = iterating_ - started_;
  sums_.times.iteration = iterated_ - iterating_;
  sums_.times.rest = graph::seconds_now() - iterated_;
}

}  // namespace talus
