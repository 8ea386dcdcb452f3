#include "runtime/step/decomposition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/morton.hpp"
#include "kernels/bodies/release.hpp"
#include "partition/halo.hpp"

namespace talus {

namespace {

/// A body as it is sent to another rank.
struct BodyRecord {
  std::int64_t id;
  double x[3];
  double radius, reach;
  double u[3], w[3];
  double inv_mass, spin_mobility;
  double orientation[4];
  std::int32_t material, shape;
};

BodyRecord record_of(const Decomposition& decomposition, const Bodies& bodies, std::span<const double> reach,
                     std::size_t s) {
  const Velocity v = whole_velocity(decomposition, bodies, s);
  BodyRecord record{};
  record.id = static_cast<std::int64_t>(bodies.id[s]);
  std::copy_n(bodies.x[s].data(), 3, record.x);
  record.radius = bodies.radius[s];
  record.reach = reach[s];
  std::copy_n(v.u, 3, record.u);
  std::copy_n(v.w, 3, record.w);
  record.inv_mass = v.inv_mass;
  record.spin_mobility = v.spin_mobility;
  if (!bodies.orientation.empty()) std::copy_n(bodies.orientation[s].data(), 4, record.orientation);
  if (!bodies.material.empty()) record.material = bodies.material[s];
  if (!bodies.shape.empty()) record.shape = bodies.shape[s];
  return record;
}

Vec3 centre_of(const BodyRecord& record) {
  return {record.x[0], record.x[1], record.x[2]};
}

Velocity velocity_of(const BodyRecord& record) {
  Velocity v;
  std::copy_n(record.u, 3, v.u);
  std::copy_n(record.w, 3, v.w);
  v.inv_mass = record.inv_mass;
  v.spin_mobility = record.spin_mobility;
  return v;
}

std::array<double, 4> orientation_of(const BodyRecord& record) {
  return {record.orientation[0], record.orientation[1], record.orientation[2], record.orientation[3]};
}

/// Points to balance: the candidates, or the bodies as long as there are no candidates.
PartitionPoints points_to_cut(const Decomposition& decomposition, const Bodies& bodies,
                              const Candidates& candidates, std::int64_t all_candidates,
                              const Domain& domain) {
  PartitionPoints points;
  if (all_candidates > 0) {
    points = candidate_points(bodies.x, candidates.grain_pairs, candidates.wall_pairs, domain);
    // Weights are integers in 64ths of the mean, or coarser: their sum stays below 2^31.
    const double unit =
        std::clamp(std::floor(std::ldexp(1.0, 30) / static_cast<double>(all_candidates)), 1.0, 64.0);
    for (const Vec3& x : decomposition.cost.empty() ? std::vector<Vec3>() : points.x)
      points.weight.push_back(static_cast<std::int32_t>(std::lround(
          unit * std::clamp(decomposition.cost[decomposition.partition.subdomain_of(x)], 0.1, 10.0))));
    return points;
  }
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if (counts(decomposition, s)) points.x.push_back(bodies.x[s]);
  points.half.assign(points.x.size(), Vec3::Zero());
  return points;
}

/// The bodies of a rank's surroundings: slots of its own, and bodies that other ranks sent.
struct Gathered {
  std::vector<Slot> own;
  std::vector<BodyRecord> come;
};

Gathered exchange_surroundings(const Decomposition& decomposition, const graph::Communicator& ranks,
                               const RankSample& sample, std::span<const double> reach) {
  const Bodies& bodies = sample.bodies;
  Gathered gathered;
  gathered.own.reserve(bodies.size());
  double largest[1] = {0};
  for (double r : reach) largest[0] = std::max(largest[0], r);
  ranks.max(largest);
  const auto here = static_cast<std::size_t>(ranks.rank());
  std::vector<std::vector<BodyRecord>> to(static_cast<std::size_t>(ranks.ranks()));
  std::vector<std::size_t> sent(to.size(), std::numeric_limits<std::size_t>::max());
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    if (!counts(decomposition, s)) continue;
    if (to.size() == 1) {  // one rank: there is nobody to send bodies to
      gathered.own.push_back(static_cast<Slot>(s));
      continue;
    }
    sample.domain.each_image(bodies.x[s], 3 * largest[0], [&](const Vec3&, const Vec3& image) {
      for (const SubdomainId subdomain : subdomains_within(decomposition.partition, image, 3 * largest[0])) {
        const std::size_t rank = at(decomposition.rank_of[subdomain]);
        if (sent[rank] == s) continue;
        sent[rank] = s;
        if (rank == here)
          gathered.own.push_back(static_cast<Slot>(s));
        else
          to[rank].push_back(record_of(decomposition, bodies, reach, s));
      }
    });
  }
  for (auto& part : ranks.exchange_records(std::move(to))) {
    gathered.come.insert(gathered.come.end(), part.begin(), part.end());
    release(part);
  }
  return gathered;
}

/// 0 if no boxes are given. A double, since the product may exceed all integers.
double count_boxes(const DecompositionSettings& settings) {
  const auto& [x, y, z] = settings.boxes;
  return static_cast<double>(x) * static_cast<double>(y) * static_cast<double>(z);
}

}  // namespace

bool counts(const Decomposition& decomposition, std::size_t slot) {
  return decomposition.counts.empty() || decomposition.counts[slot] != 0;
}

Velocity whole_velocity(const Decomposition& decomposition, const Bodies& bodies, std::size_t s) {
  Velocity v = bodies.velocity[s];
  if (!decomposition.whole.empty()) {
    v.inv_mass = decomposition.whole[s][0];
    v.spin_mobility = decomposition.whole[s][1];
  }
  return v;
}

int chunk_target(std::int64_t all, std::int64_t own) {
  constexpr std::int64_t enough_chunks = 900;
  return static_cast<int>(std::max(std::clamp<std::int64_t>(all / 32, 64, 512),
                                   std::min<std::int64_t>(own / enough_chunks, longest_chunk)));
}

Slot Surroundings::find(std::int64_t id) const {
  const auto found =
      std::lower_bound(by_id.begin(), by_id.end(), id,
                       [](const auto& entry, std::int64_t wanted) { return entry.first < wanted; });
  return found != by_id.end() && found->first == id ? found->second : -1;
}

Reduction reduction_over(const graph::Communicator& ranks) {
  return {[&ranks](std::span<std::int64_t> values) { ranks.sum(values); },
          [&ranks](std::span<double> values) { ranks.max(values); }, ranks.rank() == 0};
}

PartitionOptions partition_options(const DecompositionSettings& settings, std::int32_t subdomains) {
  PartitionOptions options;
  options.kind = settings.partitioner;
  options.subdomains = subdomains;
  for (std::size_t axis = 0; axis < 3; ++axis)
    options.boxes[axis] = static_cast<std::int32_t>(settings.boxes[axis]);
  return options;
}

DecompositionSettings with_subdomains(DecompositionSettings settings, int n) {
  settings.subdomains = n;
  if (count_boxes(settings) != n) settings.boxes = {};
  return settings;
}

Decomposition make_decomposition(const DecompositionSettings& settings, const graph::Communicator& ranks) {
  Decomposition decomposition;
  const std::int32_t subdomains = settings.subdomains > 0 ? settings.subdomains : ranks.ranks();
  if (subdomains < ranks.ranks())
    throw std::invalid_argument(fmt::format(
        "{} ranks for {} subdomains: a rank without a subdomain has nothing to do. Start fewer ranks or "
        "set decomposition.subdomains to {} or more",
        ranks.ranks(), subdomains, ranks.ranks()));
  const auto& [x, y, z] = settings.boxes;
  const double boxes = count_boxes(settings);
  if (cuts_boxes(settings.partitioner) && boxes > 0 && boxes != subdomains)
    throw std::invalid_argument(
        fmt::format("decomposition.boxes: {} x {} x {} boxes are not {} subdomains", x, y, z, subdomains));
  decomposition.partition.subdomains = subdomains;
  for (std::int32_t e = 0; e < subdomains; ++e) {
    const std::int32_t rank = settings.mapping == SubdomainMapping::cyclic
                                  ? e % ranks.ranks()
                                  : static_cast<std::int32_t>(std::int64_t{e} * ranks.ranks() / subdomains);
    decomposition.rank_of.push_back(rank);
    if (rank == ranks.rank()) decomposition.here.emplace_back(e);
  }
  decomposition.slot_begin.assign(decomposition.here.size() + 1, 0);
  return decomposition;
}

namespace {

/// Collective. Makes the partition anew, near the one before.
void cut_space(Decomposition& decomposition, const DecompositionSettings& settings,
               const graph::Communicator& ranks, const RankSample& sample) {
  const auto& [bodies, candidates, domain] = sample;
  std::int64_t all[1] = {static_cast<std::int64_t>(candidates.size())};
  ranks.sum(all);
  decomposition.blind = all[0] == 0;
  const Partition before = decomposition.partition;
  const bool first = before.tree.cuts.empty() && !before.by_table();
  PartitionOptions options = partition_options(settings, before.subdomains);
  options.previous = first ? nullptr : &before;
  options.domain = domain;
  decomposition.partition = make_partition(points_to_cut(decomposition, bodies, candidates, all[0], domain),
                                           options, reduction_over(ranks));
}

/// Fills `by_id`, and `of_slot` of the bodies that others sent here.
void index_by_id(Surroundings& around, std::span<const BodyId> id_of_slot) {
  const std::size_t count = around.bodies.size();
  around.by_id.reserve(count);
  for (std::size_t k = 0; k < count; ++k)
    around.by_id.emplace_back(static_cast<std::int64_t>(around.bodies.id[k]), static_cast<Slot>(k));
  std::sort(around.by_id.begin(), around.by_id.end());
  for (std::size_t s = 0; s < id_of_slot.size(); ++s)
    if (around.of_slot[s] < 0) around.of_slot[s] = around.find(static_cast<std::int64_t>(id_of_slot[s]));
}

}  // namespace

Surroundings collect_surroundings(Decomposition& decomposition, const DecompositionSettings& settings,
                                  const graph::Communicator& ranks, const RankSample& sample,
                                  std::span<const double> reach, bool partition_anew) {
  Bodies& bodies = sample.bodies;
  if (partition_anew) cut_space(decomposition, settings, ranks, sample);
  Gathered gathered = exchange_surroundings(decomposition, ranks, sample, reach);
  const std::size_t own = gathered.own.size(), count = own + gathered.come.size();
  /// `source`: index into the own slots, followed by the records received.
  struct Row {
    std::uint64_t key;
    std::size_t source;
  };
  std::vector<Row> order(count);
  // Field by field, so that never more than one field exists twice.
  const auto pick = [&](const Row& place, const auto& of_slot, const auto& of_record) {
    return place.source < own ? of_slot(at(gathered.own[place.source]))
                              : of_record(gathered.come[place.source - own]);
  };
  const auto id = [&](const Row& place) {
    return pick(
        place, [&](std::size_t s) { return bodies.id[s]; },
        [](const BodyRecord& record) { return BodyId{record.id}; });
  };
  const auto x = [&](const Row& place) {
    return pick(
        place, [&](std::size_t s) { return bodies.x[s]; }, centre_of);
  };
  for (std::size_t k = 0; k < count; ++k) {
    order[k].source = k;
    const auto q = decomposition.partition.frame.coordinates(x(order[k]));
    order[k].key = morton_key(q[0], q[1], q[2]);
  }
  std::sort(order.begin(), order.end(),
            [&](const Row& a, const Row& b) { return a.key != b.key ? a.key < b.key : id(a) < id(b); });
  Surroundings around;
  const auto fill = [&](auto& field, const auto& value) {
    field.reserve(count);
    for (const Row& place : order) field.push_back(value(place));
  };
  const auto take = [&](auto& field, const auto& of_slot, const auto& of_record) {
    fill(field, [&](const Row& place) { return pick(place, of_slot, of_record); });
  };
  fill(around.bodies.id, id);
  fill(around.bodies.x, x);
  take(
      around.bodies.radius, [&](std::size_t s) { return bodies.radius[s]; },
      [](const BodyRecord& record) { return record.radius; });
  release(bodies.radius);
  take(
      around.bodies.velocity, [&](std::size_t s) { return whole_velocity(decomposition, bodies, s); },
      velocity_of);
  release(bodies.velocity);
  if (decomposition.orientation)
    take(
        around.bodies.orientation, [&](std::size_t s) { return bodies.orientation[s]; }, orientation_of);
  release(bodies.orientation);
  if (decomposition.materials)
    take(
        around.bodies.material, [&](std::size_t s) { return bodies.material[s]; },
        [](const BodyRecord& record) { return static_cast<Material>(record.material); });
  release(bodies.material);
  if (decomposition.shapes)
    take(
        around.bodies.shape, [&](std::size_t s) { return bodies.shape[s]; },
        [](const BodyRecord& record) { return static_cast<ShapeNumber>(record.shape); });
  release(bodies.shape);
  take(
      around.reach, [&](std::size_t s) { return reach[s]; },
      [](const BodyRecord& record) { return record.reach; });
  around.of_slot.assign(bodies.size(), -1);
  for (std::size_t k = 0; k < count; ++k)
    if (order[k].source < own) around.of_slot[at(gathered.own[order[k].source])] = static_cast<Slot>(k);
  release(order);
  gathered = {};
  index_by_id(around, bodies.id);
  return around;
}

std::size_t memory_used(const Decomposition& decomposition) {
  std::size_t bytes =
      memory_used(decomposition.partition) +
      (decomposition.multiplicity.capacity() + decomposition.parts.capacity()) * sizeof(std::uint16_t) +
      decomposition.taken.capacity() + decomposition.subdomain_colour.capacity() +
      decomposition.counts.capacity() + decomposition.whole.capacity() * sizeof(std::array<double, 2>);
  for (const SubdomainInterface& interface : decomposition.interfaces) bytes += memory_used(interface);
  return bytes;
}

}  // namespace talus
