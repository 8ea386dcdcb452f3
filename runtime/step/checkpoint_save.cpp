/// A StepState as the part of a checkpoint.

#include <algorithm>
#include <bit>

#include "kernels/bodies/index.hpp"
#include "runtime/step/checkpoint.hpp"
#include "runtime/step/detail/checkpoint_columns.hpp"

namespace talus {

using detail::converted;
using detail::copy_run;

namespace {

void push_vector(const Vec3& v, std::vector<double>& to) {
  to.insert(to.end(), v.begin(), v.end());
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

void save_walls(const StepState& state, CheckpointHead& head) {
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    const Wall& wall = state.walls[w];
    push_vector(wall.point, head.wall_points);
    push_vector(wall.velocity, head.wall_velocities);
    push_vector(state.wall_states[w].impulse, head.wall_impulses);
    push_vector(state.wall_states[w].torque, head.wall_torques);
    head.wall_applied.push_back(state.wall_states[w].applied);
    head.wall_work.push_back(state.wall_states[w].work);
    const std::vector<double> load = numbers_of(wall.load);
    head.wall_loads.insert(head.wall_loads.end(), load.begin(), load.end());
  }
  for (const Vec3& point : state.wall_then) push_vector(point, head.wall_then);
  head.time_then = state.time_then;
}

SlotRange slots_of(const StepState& state, SubdomainPlace e) {
  return state.decomposition.several() ? state.decomposition.slots_of(e) : SlotRange{0, state.bodies.size()};
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

void save_cell(const StepState& state, CheckpointHead& head) {
  if (!state.domain.flows) return;
  const auto numbers = [](const Mat3& m) {
    return std::vector{m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)};
  };
  head.cell_edges = numbers(edges_of(state.domain));
  head.cell_rates = numbers(matrix_of(state.domain.rates));
  head.cell_edges_then = numbers(state.flow.edges_then);
}

}  // namespace

std::vector<double> numbers_of(const WallLoad& load) {
  return {static_cast<double>(load.drive),
          load.velocity[0],
          load.velocity[1],
          load.velocity[2],
          load.pressure,
          load.force,
          load.mass,
          load.weight ? 1.0 : 0.0};
}

void save_state(const StepState& state, Checkpoint& to) {
  CheckpointHead& head = to.head;
  const Decomposition& all = state.decomposition;
  save_partition(all, head);
  save_walls(state, head);
  save_cell(state, head);
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

}  // namespace talus
