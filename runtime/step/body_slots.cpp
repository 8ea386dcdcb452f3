#include "runtime/step/body_slots.hpp"

#include <algorithm>
#include <numeric>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/permute.hpp"

namespace talus {

namespace {

/// Keeps the candidates whose bodies all stay; `place` is the new slot of each old one, -1 of bodies that go.
void keep_candidates(std::span<const Slot> place, Candidates& candidates) {
  Candidates kept;
  kept.impulse = KeptImpulses(candidates.impulse.kind());
  const std::size_t grains = candidates.grain_pairs.size();
  const bool balls = !candidates.balls.empty();
  for (std::size_t k = 0; k < grains; ++k) {
    const GrainPair& pair = candidates.grain_pairs[k];
    if (place[at(pair.first)] < 0 || place[at(pair.second)] < 0) continue;
    kept.grain_pairs.push_back(pair);
    if (balls) kept.balls.push_back(candidates.balls[k]);
    kept.impulse.push_back(std::as_const(candidates.impulse).row(k));
  }
  for (std::size_t k = grains; k < candidates.size(); ++k) {
    const WallPair& pair = candidates.wall_pairs[k - grains];
    if (place[at(pair.body)] < 0) continue;
    kept.wall_pairs.push_back(pair);
    kept.impulse.push_back(std::as_const(candidates.impulse).row(k));
  }
  candidates = std::move(kept);
  renumber(candidates, place);
}

/// New slot k holds what stood in order[k]; slots that `order` does not name are dropped.
void rearrange(std::span<const Slot> order, StepState& state) {
  Bodies& bodies = state.bodies;
  std::vector<Slot> place(bodies.size(), -1);
  for (std::size_t k = 0; k < order.size(); ++k) place[at(order[k])] = static_cast<Slot>(k);
  reorder(bodies, order);
  Decomposition& all = state.decomposition;
  permute(all.multiplicity, order);
  permute(all.parts, order);
  permute(all.taken, order);
  permute(all.counts, order);
  permute(all.whole, order);
  keep_candidates(place, state.candidates);
  state.x_then.clear();
  state.reach_then.clear();
  state.candidates_valid = false;
}

/// Sets where the slots of each subdomain begin, from the number of slots of each.
void set_slot_begins(std::span<const std::size_t> counts, Decomposition& all) {
  for (std::size_t e = 0; e < counts.size(); ++e) all.slot_begin[e + 1] = all.slot_begin[e] + counts[e];
}

/// The subdomain that a new grain joins: before space is cut, the first one holds all.
SubdomainId subdomain_of(const Decomposition& all, const Vec3& x) {
  const bool cut = !all.partition.tree.cuts.empty() || all.partition.by_table();
  return all.several() && cut ? all.partition.subdomain_of(x) : SubdomainId(0);
}

void append_grain(const NewGrain& grain, const Setup& setup, StepState& state) {
  Bodies& bodies = state.bodies;
  add_grain(bodies, grain.grain, {{}, setup.seed, setup.rotation});
  const std::size_t n = bodies.size();
  // Columns that a scene has, also where it had no body yet.
  if (!setup.clumps.empty()) bodies.shape.resize(n, 0);
  if (setup.orientation || !setup.clumps.empty()) bodies.orientation.resize(n, {1, 0, 0, 0});
  if (state.decomposition.materials) bodies.material.push_back(grain.material);
  Velocity& v = bodies.velocity.back();
  std::copy_n(grain.velocity.begin(), 3, v.u);
  if (setup.rotation) std::copy_n(grain.velocity.begin() + 3, 3, v.w);
  Decomposition& all = state.decomposition;
  // The first step has not dealt anything out yet: these columns are empty then.
  if (all.interfaces.empty()) return;
  all.multiplicity.push_back(1);
  all.parts.push_back(1);
  all.counts.push_back(1);
  all.whole.push_back({v.inv_mass, v.spin_mobility});
  if (!all.subdomain_colour.empty()) all.taken.push_back(0);
}

}  // namespace

void drop_bodies(std::span<const std::int64_t> ids, StepState& state) {
  Decomposition& all = state.decomposition;
  std::vector<Slot> order;
  order.reserve(state.bodies.size());
  std::vector<std::size_t> counts(all.here.size(), 0);
  const bool several = all.several();
  std::size_t e = 0;
  for (std::size_t s = 0; s < state.bodies.size(); ++s) {
    while (several && s >= all.slot_begin[e + 1]) ++e;
    if (std::ranges::binary_search(ids, static_cast<std::int64_t>(state.bodies.id[s]))) continue;
    order.push_back(static_cast<Slot>(s));
    ++counts[e];
  }
  if (order.size() == state.bodies.size()) {
    state.candidates_valid = false;  // other ranks have lost some, and all ranks find candidates together
    return;
  }
  rearrange(order, state);
  if (several) set_slot_begins(counts, all);
}

void add_bodies(std::span<const NewGrain> grains, const Setup& setup, const graph::Communicator& ranks,
                StepState& state) {
  Decomposition& all = state.decomposition;
  const std::size_t before = state.bodies.size();
  std::vector<std::vector<Slot>> coming(all.here.size());
  for (const NewGrain& grain : grains) {
    const SubdomainId subdomain = subdomain_of(all, grain.grain.x);
    if (all.rank_of[subdomain] != ranks.rank()) continue;
    coming[all.place_of(subdomain).at()].push_back(static_cast<Slot>(state.bodies.size()));
    append_grain(grain, setup, state);
  }
  std::vector<Slot> order;
  std::vector<std::size_t> counts;
  for (std::size_t e = 0; e < coming.size(); ++e) {
    const std::size_t first = all.several() ? all.slot_begin[e] : 0;
    const std::size_t last = all.several() ? all.slot_begin[e + 1] : before;
    for (std::size_t s = first; s < last; ++s) order.push_back(static_cast<Slot>(s));
    order.insert(order.end(), coming[e].begin(), coming[e].end());
    counts.push_back(last - first + coming[e].size());
  }
  rearrange(order, state);
  if (all.several()) set_slot_begins(counts, all);
}

void sort_bodies(StepState& state) {
  const std::vector<Slot> order = morton_order(state.bodies);
  rearrange(order, state);
}

}  // namespace talus
