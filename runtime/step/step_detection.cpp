/// Detection: where bodies are in mid-step, which candidates they have, what touches.

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/bodies/release.hpp"
#include "kernels/detection/ball_pairs.hpp"
#include "kernels/detection/images.hpp"
#include "kernels/detection/materials.hpp"
#include "kernels/detection/narrow_phase.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/shapes/clump_motion.hpp"
#include "kernels/sweeps/cohesion.hpp"
#include "kernels/sweeps/rolling.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/step/step_graph.hpp"
#include "runtime/step/task_kinds.hpp"
#include "runtime/step/wall_motions.hpp"

namespace talus {

namespace {

double speed(const Velocity& v) {
  return std::sqrt(v.u[0] * v.u[0] + v.u[1] * v.u[1] + v.u[2] * v.u[2]);
}

}  // namespace

void StepGraph::predict_share(std::uint32_t share) {
  Bodies& bodies = state_.bodies;
  const SlotRange range = slots(share);
  const double h = parameters_.time_step;
  predict(range, bodies.x, bodies.velocity, h);
  if (!bodies.orientation.empty()) rotate(range, bodies, 0.5 * h);
  // The spin w of a clump belongs to its axes and changes with them, so these are turned before the free
  // velocity is found.
  turn_clumps(range, bodies, state_.clumps, 0.5 * h);
  find_free_velocities(range);
  left_[share].clear();
  if (!state_.candidates_valid) return;
  if (state_.domain.flows)
    find_flow_escape(range, share);
  else
    find_skin_escapes(range, bodies, {state_.x_then, state_.reach_then, h, parameters_.alert}, left_[share]);
}

/// V of the step without contacts.
void StepGraph::find_free_velocities(SlotRange range) {
  free_velocities(range, state_.bodies.velocity, parameters_.impulse_time(), parameters_.gravity,
                  state_.free);
  if (state_.domain.flows) add_gain(range, state_.bodies.x, state_.flow.gain, state_.free);
}

/// One body, if any, that has used up its margin in a cell that flows: candidates are found anew then.
void StepGraph::find_flow_escape(SlotRange range, std::uint32_t share) {
  const Bodies& bodies = state_.bodies;
  const FlowMargins margins(state_.domain, state_.flow);
  for (std::size_t s = range.begin; s < range.end; ++s) {
    const double reach = state_.reach_then[s];
    const double need =
        bodies.radius[s] + contact_margin(margins.speed(bodies.x[s], bodies.velocity[s], reach),
                                          parameters_.time_step, parameters_.alert);
    if (need + margins.moved(bodies.x[s], state_.x_then[s], reach) <= reach) continue;
    left_[share].push_back({});
    return;
  }
}

/// The speed of each body that counts against its margin, and from which its reach follows.
std::vector<double> StepGraph::speeds() const {
  const Bodies& bodies = state_.bodies;
  std::vector<double> speeds(bodies.size());
  if (!state_.domain.flows) {
    for (std::size_t s = 0; s < bodies.size(); ++s) speeds[s] = speed(bodies.velocity[s]);
    return speeds;
  }
  const FlowMargins margins(state_.domain, state_.flow);
  for (std::size_t s = 0; s < bodies.size(); ++s)
    speeds[s] = margins.speed(bodies.x[s], bodies.velocity[s],
                              2 * bodies.radius[s] + parameters_.alert + parameters_.skin);
  return speeds;
}

/// Replaces centres and velocities of bodies by those of their images in the cell.
void StepGraph::wrap_bodies() {
  Bodies& bodies = state_.bodies;
  if (!state_.domain.flows) {
    for (Vec3& x : bodies.x) x = state_.domain.wrap(x);
    return;
  }
  upright(state_.domain, state_.flow);
  state_.flow.edges_then = edges_of(state_.domain);
  for (std::size_t s = 0; s < bodies.size(); ++s) wrap_body(state_.domain, bodies.x[s], bodies.velocity[s]);
  find_free_velocities({0, bodies.size()});
}

/// Margin of a wall: what brings a grain nearer to it and is not in the grain's own margin. That is the way
/// of the wall, what gravity adds to the grain's speed within a step, and what the load adds to the wall's.
double StepGraph::margin_of(std::size_t w) const {
  const double h = parameters_.time_step;
  const Wall& wall = state_.walls[w];
  const double speed = wall.motion.empty() ? wall.velocity.norm() : state_.wall_states[w].speed;
  return contact_margin(speed, h, parameters_.alert) +
         h * (h * parameters_.gravity.norm() + wall.gain.norm());
}

/// How far a wall has come nearer to any grain since the last broad phase, at most [m].
double StepGraph::way_of_wall(std::size_t w) const {
  const Wall& wall = state_.walls[w];
  return wall.motion.empty() ? std::abs(wall.normal.dot(wall.point - state_.wall_then[w]))
                             : way_since(setup_.walls[w], wall, state_.wall_states[w], state_.time_then);
}

bool StepGraph::walls_left_margin() const {
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    if (!state_.walls[w].absent && margin_of(w) + way_of_wall(w) > wall_margin_[w]) return true;
  return false;
}

/// At the end of the step: whether a wall has come further than the margin with which candidates were found.
bool StepGraph::walls_beyond_margin() const {
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    if (!state_.walls[w].absent && way_of_wall(w) > wall_margin_[w]) return true;
  return false;
}

bool StepGraph::needs_broad_phase() {
  const bool left = std::any_of(left_.begin(), left_.end(), [](const auto& share) { return !share.empty(); });
  double needed[2] = {!state_.candidates_valid || walls_left_margin() || out_of_balance() ? 1.0 : 0.0,
                      left ? 1.0 : 0.0};
  ranks_.max(needed);
  return needed[0] > 0 || (needed[1] > 0 && (state_.domain.flows || !candidates_hold()));
}

/// Whether the grains that left their margins, few of them, meet none but their candidates. Collective; the
/// same for any ranks, since the grains and their candidates are put together from all of them.
bool StepGraph::candidates_hold() const {
  constexpr std::size_t few = 32;  // comparing them costs little beside a broad phase
  std::vector<Escape> skin_escapes;
  for (const auto& share : left_) skin_escapes.insert(skin_escapes.end(), share.begin(), share.end());
  skin_escapes = ranks_.gather_records(std::span<const Escape>(skin_escapes));
  std::sort(skin_escapes.begin(), skin_escapes.end());  // copies side by side, whichever rank comes first
  skin_escapes.erase(std::unique(skin_escapes.begin(), skin_escapes.end(),
                                 [](const Escape& a, const Escape& b) { return a.id == b.id; }),
                     skin_escapes.end());
  if (skin_escapes.size() > few) return false;
  for (const Escape& escape : skin_escapes) {
    if (!std::isfinite(escape.need + escape.x[0] + escape.x[1] + escape.x[2])) return false;  // a runaway
    // It may have passed through a grain within the step; only a candidate would have shown that.
    const double speed = std::hypot(escape.u[0], escape.u[1], escape.u[2]);
    if (parameters_.time_step * speed > 0.5 * escape.radius) return false;
  }
  std::vector<Encounter> needed, known;
  compare_skin_escapes(skin_escapes, state_.bodies, state_.candidates,
                       {state_.x_then, state_.reach_then, parameters_.time_step, parameters_.alert,
                        parameters_.gravity, state_.walls, state_.domain},
                       needed, known);
  return all_known(ranks_.gather_records(std::span<const Encounter>(needed)),
                   ranks_.gather_records(std::span<const Encounter>(known)));
}

void StepGraph::make_cells() {
  const double h = parameters_.time_step;
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    Wall& wall = state_.walls[w];
    WallState& wall_state = state_.wall_states[w];
    if (wall.motion.empty())
      wall.point += 0.5 * h * wall.velocity;
    else
      place(setup_.walls[w], wall_state.middle, wall);
    wall_state.own_point = own_point(setup_.walls[w], wall, wall_state.middle);
  }
  if (steps_ == partitioned_ + 1 || imbalance_before_ < imbalance_then_) imbalance_then_ = imbalance_before_;
  sums_.broad_phase = needs_broad_phase();
  if (!sums_.broad_phase) return;
  Bodies& bodies = state_.bodies;
  if (state_.domain.repeats) wrap_bodies();
  const std::vector<double> speed_of = speeds();
  std::vector<double> reach(bodies.size());
  const double half_skin = 0.5 * parameters_.skin;
  // Free-flying grains use up half a skin at once: they get up to one skin more, but no more than their way
  // of three steps.
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    const double v = speed_of[s];
    reach[s] = bodies.radius[s] + half_skin + contact_margin(v, h, parameters_.alert) +
               std::min(3 * h * v, parameters_.skin);
  }
  state_.wall_then.clear();
  wall_margin_.clear();
  state_.time_then = state_.time + 0.5 * h;
  for (std::size_t w = 0; w < state_.walls.size(); ++w) {
    state_.wall_then.push_back(state_.walls[w].point);
    wall_margin_.push_back(half_skin + margin_of(w));
  }
  // The impulses of the candidates hold what the last step found, so detection may use the memory of
  // contacts.
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
        state_.decomposition.cost = costs(decomposition_.balance == BalanceBy::time ? loop_.busy() : work());
    }
    make_room();
    const double began = graph::seconds_now();
    trace::Span span(executor_.trace(), kind_of(TaskKind::partition));
    around_ = collect_surroundings(state_.decomposition, decomposition_, ranks_,
                                   {bodies, state_.candidates, state_.domain}, reach, anew);
    span.end();
    sums_.times.dealing = graph::seconds_now() - began;
    sort_into_cells(around_.bodies.x, around_.reach);
    return;
  }
  make_room();
  state_.x_then = bodies.x;
  state_.reach_then = std::move(reach);
  sort_into_cells(state_.x_then, state_.reach_then);
}

void StepGraph::sort_into_cells(std::span<const Vec3> x, std::span<const double> reach) {
  if (!state_.domain.repeats) {
    cells_ = build_cells(x, reach);
    return;
  }
  ImagedBodies imaged = with_images(state_.domain, x, reach);
  cells_ = build_cells(imaged.x, imaged.reach);
  images_ = std::move(imaged.original);
}

void StepGraph::find_pairs_of_share(std::uint32_t share) {
  if (!sums_.broad_phase) return;
  pairs_[share].clear();
  const SlotRange range = range_of_share(cells_.cells.size(), share);
  find_pairs(cells_, range.begin, range.end, pairs_[share]);
  if (state_.domain.repeats) fold_images(cells_.slots.size() - images_.size(), images_, pairs_[share]);
}

void StepGraph::make_chunks() {
  if (!sums_.broad_phase) return;
  cells_ = {};
  images_ = {};
  const bool several = state_.decomposition.several();
  Candidates fresh;
  fresh.impulse = KeptImpulses(parameters_.impulses());
  fresh.grain_pairs = sort_pairs(pairs_, several ? around_.bodies.size() : state_.bodies.size());
  if (state_.domain.repeats) drop_repeated(fresh.grain_pairs);
  for (auto& part : pairs_) release(part);
  fresh.wall_pairs =
      find_wall_pairs(several ? around_.bodies.x : state_.bodies.x,
                      several ? around_.reach : state_.reach_then, state_.walls, wall_margin_, state_.domain);
  split_into_balls(clumps_of(state_, several ? around_.bodies : state_.bodies), fresh);
  std::vector<char> glued;
  for (const Wall& wall : state_.walls) glued.push_back(wall.inv_mass() > 0 ? 1 : 0);
  const bool begins = std::exchange(state_.forces_given, false);
  Candidates given;
  if (begins) given = take_given_forces();
  std::vector<CandidateGroup> groups;
  const double began = graph::seconds_now();
  if (several) {
    const trace::Span span(executor_.trace(), kind_of(TaskKind::partition));
    groups = distribute(state_.decomposition, decomposition_, ranks_, around_,
                        {std::move(fresh), glued, begins ? &given : nullptr},
                        {state_.bodies, state_.candidates, state_.domain});
    sums_.migrants = state_.decomposition.migrants;
    renew_slots();
    sums_.times.dealing += graph::seconds_now() - began;
  } else {
    match_impulses(begins ? given : state_.candidates, fresh);
    state_.candidates = std::move(fresh);
    const auto all = static_cast<std::int64_t>(state_.candidates.size());
    groups = groups_of_one_subdomain(state_.candidates, glued, chunk_target(all, all));
  }
  set_up_chunks(groups);
  const double planning = graph::seconds_now();
  loop_.plan();
  if (several) sums_.times.dealing += graph::seconds_now() - planning;
  std::int64_t candidates[1] = {static_cast<std::int64_t>(state_.candidates.size())};
  ranks_.sum(candidates);
  all_candidates_ = candidates[0];
  state_.candidates_valid = true;
  planned_ = false;
}

/// Candidates with the forces given, from which the first step starts: between slots, or with several
/// subdomains between places in the surroundings. Collective.
Candidates StepGraph::take_given_forces() {
  const Bodies& bodies = state_.decomposition.several() ? around_.bodies : state_.bodies;
  std::vector<std::pair<std::int64_t, Slot>> by_id;
  for (std::size_t s = 0; s < bodies.size(); ++s)
    by_id.emplace_back(static_cast<std::int64_t>(bodies.id[s]), static_cast<Slot>(s));
  std::ranges::sort(by_id);
  const std::vector<GivenForce> forces = std::exchange(state_.given_forces, {});
  return given_candidates(forces, ranks_, parameters_.impulses(), parameters_.impulse_time(), bodies.size(),
                          [&](std::int64_t id) -> Slot {
                            const auto found = std::ranges::lower_bound(by_id, std::pair(id, Slot{0}));
                            return found != by_id.end() && found->first == id ? found->second : -1;
                          });
}

/// Chunks of the groups, and rooms for their contacts.
void StepGraph::set_up_chunks(std::span<const CandidateGroup> groups) {
  state_.chunks = cut_chunks(state_.candidates, groups, state_.bodies.size(), state_.decomposition.taken);
  note_kinds(clumps_of(state_), state_.chunks);
  note_laws(state_.candidates, {state_.bodies.material, state_.walls}, state_.chunks);
  allocate(state_.contacts, state_.candidates, state_.chunks, parameters_.friction);
  if (parameters_.laws.attract()) state_.contacts.cohesion.resize(state_.candidates.size());
  state_.contacts.drifts_between = state_.domain.flows;
  state_.contacts.reach.resize(state_.cell.loaded() ? state_.candidates.size() : 0);
  const bool drifts = state_.domain.flows || std::ranges::any_of(state_.walls, &Wall::has_drift);
  for (auto* values : {&state_.contacts.vx, &state_.contacts.vy, &state_.contacts.vz})
    values->resize(drifts ? state_.candidates.size() : 0);
  state_.contacts.spin.resize(drifts ? state_.contacts.arm.size() : 0, Vec3::Zero());
}

/// Moves what is kept per slot to the new slots of the copies.
void StepGraph::renew_slots() {
  const Bodies& bodies = state_.bodies;
  state_.x_then = bodies.x;
  state_.reach_then.clear();
  for (const SubdomainInterface& interface : state_.decomposition.interfaces)
    for (Slot body : interface.bodies)
      state_.reach_then.push_back(around_.reach[static_cast<std::size_t>(body)]);
  around_ = {};
  state_.free.u.resize(bodies.size());
  state_.free.w.resize(parameters_.rotates ? bodies.size() : 0);
  find_free_velocities({0, bodies.size()});
}

void StepGraph::narrow_share(std::uint32_t share) {
  const Bodies& bodies = state_.bodies;
  if (!settings_.warm_start) {
    const SlotRange own = range_of_share(state_.chunks.size(), share);
    const auto begin = static_cast<std::size_t>(state_.chunks.begin[own.begin]),
               end = static_cast<std::size_t>(state_.chunks.begin[own.end]);
    std::ranges::fill(state_.candidates.impulse.values(begin, end), 0.0);
  }
  const NarrowPhase in{bodies.x,
                       bodies.radius,
                       bodies.velocity,
                       state_.walls,
                       parameters_.time_step,
                       parameters_.alert,
                       parameters_.laws,
                       parameters_.gravity,
                       parameters_.turning,
                       parameters_.reflection,
                       bodies.material,
                       clumps_of(state_),
                       state_.domain,
                       state_.cell.loaded() ? state_.cell.length : 0};
  const SlotRange range = range_of_share(state_.chunks.size(), share);
  for (std::size_t c = range.begin; c < range.end; ++c) {
    narrow_chunk(in, state_.candidates, state_.chunks, c, loop_.kernels().set(), state_.contacts);
    find_cohesion(in, state_.candidates, state_.chunks, c, state_.contacts);
    find_arms(in, state_.candidates, state_.chunks, c, state_.contacts);
  }
}

}  // namespace talus
