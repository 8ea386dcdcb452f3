/// A StepState as the part of a checkpoint, and back.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "kernels/bodies/index.hpp"
#include "runtime/step/checkpoint.hpp"

namespace talus {

namespace {

template <class To, class From>
std::vector<To> converted(const From& from) {
  std::vector<To> to;
  to.reserve(from.size());
  for (const auto& value : from) to.push_back(static_cast<To>(value));
  return to;
}

void push_vector(const Vec3& v, std::vector<double>& to) {
  to.insert(to.end(), v.begin(), v.end());
}
Vec3 vector_at(const std::vector<double>& from, std::size_t k) {
  return {from.at(3 * k), from.at(3 * k + 1), from.at(3 * k + 2)};
}

void demand(bool fits, const char* what) {
  if (!fits) throw std::invalid_argument(fmt::format("the checkpoint is damaged: {}", what));
}

void save_partition(const Decomposition& all, CheckpointHead& head) {
  const Partition& partition = all.partition;
  head.subdomains = partition.subdomains;
  head.partitioner = partition.kind.name();
  head.frame_low = partition.frame.low;
  head.frame_lengths = partition.frame.lengths;
  head.frame_scale = partition.frame.scale;
  for (const CutTree::Cut& cut : partition.tree.cuts) {
    // A key has at most 63 bits: three coordinates of 21.
    const std::int64_t numbers[] = {cut.axis, static_cast<std::int64_t>(cut.key), cut.below, cut.above};
    head.cuts.insert(head.cuts.end(), std::begin(numbers), std::end(numbers));
  }
  head.table_cells = converted<std::int64_t>(partition.table.cells);
  head.table = converted<std::int64_t>(partition.table.subdomain);
  head.subdomain_colour = converted<std::int64_t>(all.subdomain_colour);
  head.cost = all.cost;
  head.blind = all.blind;
  head.orientation = all.orientation;
  head.materials = all.materials;
  head.shapes = all.shapes;
  head.migrants = all.migrants;
  head.imbalance = all.imbalance;
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

void save_walls(const StepState& state, CheckpointHead& head) {
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    const Wall& wall = state.walls[w];
    push_vector(wall.point, head.wall_points);
    push_vector(wall.velocity, head.wall_velocities);
    push_vector(state.wall_states[w].impulse, head.wall_impulses);
    head.wall_applied.push_back(state.wall_states[w].applied);
    const std::vector<double> load = numbers_of(wall.load);
    head.wall_loads.insert(head.wall_loads.end(), load.begin(), load.end());
  }
  for (const Vec3& point : state.wall_then) push_vector(point, head.wall_then);
}

SlotRange slots_of(const StepState& state, SubdomainPlace e) {
  return state.decomposition.several() ? state.decomposition.slots_of(e) : SlotRange{0, state.bodies.size()};
}

template <class T, class U>
void copy_run(const std::vector<T>& from, SlotRange range, std::vector<U>& to) {
  if (from.empty()) return;
  static_assert(sizeof(T) == sizeof(U) && std::is_trivially_copyable_v<U>);
  to.reserve(range.end - range.begin);
  for (std::size_t s = range.begin; s < range.end; ++s) {
    if constexpr (std::is_same_v<T, Vec3>)
      to.push_back({from[s][0], from[s][1], from[s][2]});
    else
      to.push_back(std::bit_cast<U>(from[s]));
  }
}

void save_bodies(const StepState& state, SubdomainPlace e, CheckpointPart& part) {
  const SlotRange range = slots_of(state, e);
  const Bodies& bodies = state.bodies;
  copy_run(bodies.id, range, part.id);
  copy_run(bodies.x, range, part.x);
  copy_run(bodies.radius, range, part.radius);
  copy_run(bodies.velocity, range, part.velocity);
  copy_run(bodies.orientation, range, part.orientation);
  copy_run(bodies.material, range, part.material);
  copy_run(bodies.shape, range, part.shape);
  copy_run(state.x_then, range, part.x_then);
  copy_run(state.reach_then, range, part.reach_then);
  const Decomposition& all = state.decomposition;
  copy_run(all.multiplicity, range, part.multiplicity);
  copy_run(all.parts, range, part.parts);
  copy_run(all.taken, range, part.taken);
  copy_run(all.counts, range, part.counts);
  copy_run(all.whole, range, part.whole);
}

void save_interface(const SubdomainInterface& interface, CheckpointPart& part) {
  part.shared = interface.shared;
  for (const SubdomainId owner : interface.owner) part.owner.push_back(owner.value());
  for (const Neighbour& neighbour : interface.neighbours)
    part.neighbours.push_back({neighbour.subdomain.value(), neighbour.begin, neighbour.end});
  part.exchange = interface.exchange;
  part.copies_begin = interface.copies_begin;
  for (const CopySource& copy : interface.copies) part.copies.push_back({copy.neighbour, copy.place.value()});
  part.hubs = interface.hubs;
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

/// Candidates of a chunk, with what the last narrow phase made of them.
void save_chunk(const StepState& state, std::size_t c, Slot first_slot, CheckpointPart& part) {
  const Chunks& chunks = state.chunks;
  const Candidates& candidates = state.candidates;
  const std::size_t grains = candidates.grain_pairs.size();
  const std::size_t begin = at(chunks.begin[c]), end = at(chunks.begin[c + 1]);
  const bool known = state.candidates_valid && state.contacts.candidate.size() == candidates.size();
  part.chunks.push_back({static_cast<std::int32_t>(end - begin), chunks.wall[c],
                         static_cast<std::int32_t>(chunks.side[c]), known ? state.contacts.count[c] : 0});
  for (std::size_t k = begin; k < end; ++k) {
    if (k < grains) {
      const GrainPair& pair = candidates.grain_pairs[k];
      part.grain_pairs.push_back({pair.first - first_slot, pair.second - first_slot});
      if (!candidates.balls.empty()) part.balls.push_back(candidates.balls[k]);
    } else {
      const WallPair& pair = candidates.wall_pairs[k - grains];
      part.wall_pairs.push_back({pair.wall, pair.body - first_slot, pair.feature});
    }
    const std::span<const double> row = candidates.impulse.row(k);
    const bool acts =
        std::ranges::any_of(row, [](double value) { return std::bit_cast<std::uint64_t>(value) != 0; });
    part.acts.push_back(acts ? 1 : 0);
    if (acts) part.impulses.insert(part.impulses.end(), row.begin(), row.end());
  }
  if (!known || chunks.wall[c] >= 0 || chunks.kind[c] == ChunkKind::blocks) return;
  for (std::size_t k = begin; k < end; ++k)
    part.order.push_back(static_cast<std::uint16_t>(at(state.contacts.candidate[k]) - begin));
  const std::uint8_t* group = state.contacts.group.data() + begin;
  for (std::int32_t sum = 0; sum < state.contacts.count[c]; sum += *group++) part.groups.push_back(*group);
}

}  // namespace

std::vector<double> numbers_of(const WallLoad& load) {
  return {static_cast<double>(load.drive),
          load.velocity[0],
          load.velocity[1],
          load.velocity[2],
          load.pressure,
          load.force,
          load.mass};
}

void save_state(const StepState& state, Checkpoint& to) {
  CheckpointHead& head = to.head;
  const Decomposition& all = state.decomposition;
  save_partition(all, head);
  save_walls(state, head);
  head.candidates_valid = state.candidates_valid;
  head.impulse_kind = static_cast<std::int64_t>(state.candidates.impulse.kind());
  head.overlaps_given = state.given_overlaps.has_value();
  if (state.given_overlaps)
    for (const GivenOverlap& given : *state.given_overlaps) {
      head.overlap_pairs.push_back(given.pair.body);
      head.overlap_pairs.push_back(given.pair.with);
      head.overlap_depths.push_back(given.depth);
    }
  to.parts.resize(all.here.size());
  for (const SubdomainPlace e : all.here.indices()) {
    to.here.push_back(all.here[e].value());
    save_bodies(state, e, to.parts[e.at()]);
    if (all.several() && !all.interfaces.empty()) save_interface(all.interfaces[e], to.parts[e.at()]);
  }
  for (std::size_t c = 0; c < state.chunks.size(); ++c) {
    const SubdomainPlace e(state.chunks.subdomain[c]);
    save_chunk(state, c, static_cast<Slot>(slots_of(state, e).begin), to.parts[e.at()]);
  }
}

namespace {

template <class U, class T>
void append_run(const std::vector<U>& from, std::vector<T>& to) {
  for (const U& value : from) {
    if constexpr (std::is_same_v<T, Vec3>)
      to.emplace_back(value[0], value[1], value[2]);
    else
      to.push_back(std::bit_cast<T>(value));
  }
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
    state.wall_states[w].applied = head.wall_applied.at(w);
  }
  for (std::size_t w = 0; 3 * w < head.wall_then.size(); ++w)
    state.wall_then.push_back(vector_at(head.wall_then, w));
}

}  // namespace

StepState restore_state(const Setup& setup, const Checkpoint& from, const graph::Communicator& ranks) {
  const CheckpointHead& head = from.head;
  StepState state;
  state.decomposition = make_decomposition(with_subdomains(setup.decomposition, head.subdomains), ranks);
  Decomposition& all = state.decomposition;
  demand(from.parts.size() == all.here.size(), "subdomains");
  restore_partition(head, all);
  state.walls = setup.walls;
  state.clumps = setup.clumps;
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
      contacts.first_record[k] = record_of(pair.first);
      contacts.second_record[k] = record_of(pair.second);
    }
    std::uint8_t* group = contacts.group.data() + begin;
    for (std::int32_t sum = 0; sum < count; sum += *group++) {
      *group = part.groups.at(read[e].group++);
      demand(*group > 0 && sum + *group <= count, "groups");
    }
  });
}

}  // namespace talus
