/// A StepState from the part of a checkpoint.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "kernels/bodies/index.hpp"
#include "runtime/step/checkpoint.hpp"
#include "runtime/step/detail/checkpoint_columns.hpp"
#include "runtime/step/wall_motions.hpp"

namespace talus {

using detail::append_run;
using detail::converted;

namespace {

Vec3 vector_at(const std::vector<double>& from, std::size_t k) {
  return {from.at(3 * k), from.at(3 * k + 1), from.at(3 * k + 2)};
}

void demand(bool fits, const char* what) {
  if (!fits) throw std::invalid_argument(fmt::format("the checkpoint is damaged: {}", what));
}

void restore_partition(const CheckpointHead& head, Decomposition& all) {
  Partition& partition = all.partition;
  partition.kind = partition_kind(head.partitioner);
  partition.frame = {head.frame_low, head.frame_lengths, head.frame_scale};
  for (std::size_t k = 0; k + 4 <= head.cuts.size(); k += 4)
    partition.tree.cuts.push_back(
        {static_cast<std::int32_t>(head.cuts[k]), static_cast<std::uint64_t>(head.cuts[k + 1]),
         static_cast<std::int32_t>(head.cuts[k + 2]), static_cast<std::int32_t>(head.cuts[k + 3])});
  demand(head.table_cells.size() == 3, "table_cells");
  for (std::size_t k = 0; k < 3; ++k)
    partition.table.cells[k] = static_cast<std::int32_t>(head.table_cells[k]);
  partition.table.subdomain = converted<std::int32_t>(head.table);
  const std::vector<char> colours = converted<char>(head.subdomain_colour);
  all.subdomain_colour.assign(colours.begin(), colours.end());
  all.cost.assign(head.cost.begin(), head.cost.end());
  all.blind = head.blind;
  all.orientation = head.orientation;
  all.materials = head.materials;
  all.shapes = head.shapes;
  all.migrants = head.migrants;
  all.imbalance = head.imbalance;
}

SubdomainInterface restored_interface(SubdomainId subdomain, const CheckpointPart& part) {
  SubdomainInterface interface;
  interface.subdomain = subdomain;
  interface.bodies.resize(part.id.size());
  std::iota(interface.bodies.begin(), interface.bodies.end(), 0);
  interface.multiplicity = converted<std::int32_t>(part.multiplicity);
  interface.shared = part.shared;
  for (const std::int32_t owner : part.owner) interface.owner.emplace_back(owner);
  for (const auto& [other, begin, end] : part.neighbours)
    interface.neighbours.push_back({SubdomainId(other), begin, end});
  interface.exchange = part.exchange;
  interface.copies_begin = part.copies_begin;
  for (const auto& [neighbour, place] : part.copies)
    interface.copies.push_back({neighbour, MessagePlace(place)});
  interface.hubs = part.hubs;
  return interface;
}

void append_bodies(const CheckpointPart& part, StepState& state) {
  Bodies& bodies = state.bodies;
  append_run(part.id, bodies.id);
  append_run(part.x, bodies.x);
  append_run(part.radius, bodies.radius);
  append_run(part.velocity, bodies.velocity);
  append_run(part.orientation, bodies.orientation);
  append_run(part.material, bodies.material);
  append_run(part.shape, bodies.shape);
  append_run(part.x_then, state.x_then);
  append_run(part.reach_then, state.reach_then);
  Decomposition& all = state.decomposition;
  append_run(part.multiplicity, all.multiplicity);
  append_run(part.parts, all.parts);
  append_run(part.taken, all.taken);
  append_run(part.counts, all.counts);
  append_run(part.whole, all.whole);
}

/// How far a part has been read.
struct Cursor {
  std::size_t chunk = 0, grain = 0, wall = 0, candidate = 0, impulse = 0;
};

void append_chunk(const CheckpointPart& part, Slot first_slot, Cursor& cursor, Candidates& to) {
  const auto& [length, wall, side, contacts] = part.chunks[cursor.chunk++];
  const std::size_t kind = static_cast<std::size_t>(to.impulse.kind());
  const std::vector<double> zeros(kind, 0.0);
  for (std::int32_t k = 0; k < length; ++k) {
    if (wall < 0) {
      const auto& [first, second] = part.grain_pairs.at(cursor.grain);
      to.grain_pairs.push_back({first + first_slot, second + first_slot});
      if (!part.balls.empty()) to.balls.push_back(part.balls.at(cursor.grain));
      ++cursor.grain;
    } else {
      const auto& [of, body, feature] = part.wall_pairs.at(cursor.wall++);
      to.wall_pairs.push_back({of, body + first_slot, feature});
    }
    if (part.acts.at(cursor.candidate++) == 0) {
      to.impulse.push_back(zeros);
      continue;
    }
    demand(cursor.impulse + kind <= part.impulses.size(), "impulses");
    to.impulse.push_back(std::span(part.impulses).subspan(cursor.impulse, kind));
    cursor.impulse += kind;
  }
}

/// Calls visit(place, cursor) for the chunks of all parts in the order of a rank: those between grains,
/// subdomain after subdomain, then those at each wall.
template <class Visit>
void each_chunk(const Checkpoint& from, std::size_t walls, const Visit& visit) {
  std::vector<Cursor> cursors(from.parts.size());
  for (std::int32_t wall = -1; wall < static_cast<std::int32_t>(walls); ++wall)
    for (std::size_t e = 0; e < from.parts.size(); ++e) {
      const auto& chunks = from.parts[e].chunks;
      while (cursors[e].chunk < chunks.size() && chunks[cursors[e].chunk][1] == wall) visit(e, cursors[e]);
    }
  for (std::size_t e = 0; e < from.parts.size(); ++e)
    demand(cursors[e].chunk == from.parts[e].chunks.size(), "chunks are not in the order of walls");
}

void restore_walls(const CheckpointHead& head, StepState& state) {
  demand(head.wall_points.size() == 3 * state.walls.size(), "it has other walls than the scene");
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    state.walls[w].point = vector_at(head.wall_points, w);
    state.walls[w].velocity = vector_at(head.wall_velocities, w);
    state.wall_states[w].impulse = vector_at(head.wall_impulses, w);
    state.wall_states[w].torque = vector_at(head.wall_torques, w);
    state.wall_states[w].applied = head.wall_applied.at(w);
    state.wall_states[w].work = head.wall_work.at(w);
  }
  for (std::size_t w = 0; 3 * w < head.wall_then.size(); ++w)
    state.wall_then.push_back(vector_at(head.wall_then, w));
  state.time_then = head.time_then;
}

EdgeRates six_numbers(const std::vector<double>& v) {
  return {v[0], v[1], v[2], v[3], v[4], v[5]};
}

}  // namespace

void restore_cell(const CheckpointHead& head, Domain& domain) {
  if (head.cell_edges.empty()) return;
  demand(domain.repeats && head.cell_edges.size() == 6 && head.cell_rates.size() == 6 &&
             head.cell_edges_then.size() == 6,
         "it has another cell than the scene");
  domain.flows = true;
  set_edges(domain, matrix_of(six_numbers(head.cell_edges)));
  domain.rates = six_numbers(head.cell_rates);
}

StepState restore_state(const Setup& setup, const Checkpoint& from, const graph::Communicator& ranks) {
  const CheckpointHead& head = from.head;
  StepState state;
  state.decomposition = make_decomposition(with_subdomains(setup.decomposition, head.subdomains), ranks);
  Decomposition& all = state.decomposition;
  demand(from.parts.size() == all.here.size(), "subdomains");
  demand(head.stage_begins.size() == static_cast<std::size_t>(head.stage_index) + 1, "stages");
  demand(head.stress_at_start.size() == cell_freedoms, "the stress of its sample");
  restore_partition(head, all);
  state.walls = setup.walls;
  simplify_motions(state.walls);  // in their first places, as when the run began
  state.clumps = setup.clumps;
  state.domain = setup.domain;
  restore_cell(head, state.domain);
  if (!head.cell_edges_then.empty()) state.flow.edges_then = matrix_of(six_numbers(head.cell_edges_then));
  state.wall_states.resize(state.walls.size());
  restore_walls(head, state);
  for (const SubdomainPlace e : all.here.indices()) {
    const CheckpointPart& part = from.parts[e.at()];
    append_bodies(part, state);
    all.slot_begin[e.at() + 1] = state.bodies.size();
    if (all.several()) all.interfaces.push_back(restored_interface(all.here[e], part));
  }
  if (!all.several()) all.slot_begin.assign(2, 0);
  validate(state.bodies);
  state.free.u.resize(state.bodies.size());
  Candidates& candidates = state.candidates;
  candidates.impulse = KeptImpulses(static_cast<ImpulseKind>(head.impulse_kind));
  each_chunk(from, state.walls.size(), [&](std::size_t e, Cursor& cursor) {
    const std::size_t first = all.several() ? all.slot_begin[e] : 0;
    append_chunk(from.parts[e], static_cast<Slot>(first), cursor, candidates);
  });
  state.candidates_valid = head.candidates_valid;
  if (head.overlaps_given) {
    state.given_overlaps.emplace();
    for (std::size_t k = 0; k < head.overlap_depths.size(); ++k)
      state.given_overlaps->push_back(
          {{head.overlap_pairs.at(2 * k), head.overlap_pairs.at(2 * k + 1)}, head.overlap_depths[k]});
  }
  return state;
}

std::vector<CandidateGroup> restored_groups(const StepState& state, const Checkpoint& from) {
  std::vector<CandidateGroup> groups;
  std::int32_t begin = 0;
  each_chunk(from, state.walls.size(), [&](std::size_t e, Cursor& cursor) {
    const auto& [length, wall, side, contacts] = from.parts[e].chunks[cursor.chunk++];
    demand(length > 0, "a chunk without candidates");
    // A group of its own, which is cut no further.
    groups.push_back(
        {begin, begin + length, wall, static_cast<std::int32_t>(e), static_cast<ChunkSide>(side), length});
    begin += length;
  });
  return groups;
}

void restore_contacts(const Checkpoint& from, StepState& state) {
  Contacts& contacts = state.contacts;
  const Chunks& chunks = state.chunks;
  struct Read {
    std::size_t order = 0, group = 0;
  };
  std::vector<Read> read(from.parts.size());
  std::size_t c = 0;
  each_chunk(from, state.walls.size(), [&](std::size_t e, Cursor& cursor) {
    const CheckpointPart& part = from.parts[e];
    const auto& [length, wall, side, count] = part.chunks[cursor.chunk++];
    contacts.count[c] = count;
    const std::size_t begin = at(chunks.begin[c]);
    const bool dealt = wall < 0 && chunks.kind[c] != ChunkKind::blocks;
    ++c;
    if (!dealt) return;
    for (std::size_t k = begin; k < begin + at(length); ++k) {
      const std::size_t candidate = begin + part.order.at(read[e].order++);
      demand(candidate < begin + at(length), "order");
      const GrainPair& pair = state.candidates.grain_pairs[candidate];
      contacts.candidate[k] = static_cast<std::int32_t>(candidate);
      contacts.first[k] = pair.first;
      contacts.second[k] = pair.second;
    }
    std::uint8_t* group = contacts.group.data() + begin;
    for (std::int32_t sum = 0; sum < count; sum += *group++) {
      *group = part.groups.at(read[e].group++);
      demand(*group > 0 && sum + *group <= count, "groups");
    }
  });
}

}  // namespace talus
