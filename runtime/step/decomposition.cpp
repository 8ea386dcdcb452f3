#include "runtime/step/decomposition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "kernels/morton.hpp"
#include "partition/halo.hpp"

namespace talus {

namespace {

/// A body on its way to another rank.
struct BodyRecord {
  std::int64_t id;
  double x[3];
  double radius, reach;
  double u[3], w[3];
  double inv_mass, spin_mobility;
  double orientation[4];
};

/// A warm start on its way.
struct ImpulseRecord {
  std::int64_t first;
  std::int64_t second;  ///< -1 - wall at a wall
  double r[3];          ///< on the first body; r[0] alone without friction
};

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

Reduction reduction_over(const graph::Communicator& ranks) {
  if (ranks.ranks() == 1) return {};
  return {[&ranks](std::span<std::int64_t> values) { ranks.sum(values); },
          [&ranks](std::span<double> values) { ranks.max(values); }, ranks.rank() == 0};
}

bool counts(const Decomposition& decomposition, std::size_t slot) {
  return decomposition.counts.empty() || decomposition.counts[slot] != 0;
}

/// The midpoint decides; at a wall the centre.
Vec3 point_of(const Candidates& candidates, std::size_t k, std::span<const Vec3> x) {
  const std::size_t grains = candidates.grain_pairs.size();
  if (k >= grains) return x[at(candidates.wall_pairs[k - grains].body)];
  const GrainPair& pair = candidates.grain_pairs[k];
  return 0.5 * (x[at(pair.first)] + x[at(pair.second)]);
}

BodyRecord record_of(const Decomposition& decomposition, const Bodies& bodies, std::span<const double> reach,
                     std::size_t s) {
  const Velocity& v = bodies.velocity[s];
  BodyRecord record{};
  record.id = static_cast<std::int64_t>(bodies.id[s]);
  std::copy_n(bodies.x[s].data(), 3, record.x);
  record.radius = bodies.radius[s];
  record.reach = reach[s];
  std::copy_n(v.u, 3, record.u);
  std::copy_n(v.w, 3, record.w);
  record.inv_mass = decomposition.whole.empty() ? v.inv_mass : decomposition.whole[s][0];
  record.spin_mobility = decomposition.whole.empty() ? v.spin_mobility : decomposition.whole[s][1];
  if (!bodies.orientation.empty()) std::copy_n(bodies.orientation[s].data(), 4, record.orientation);
  return record;
}

void append(const BodyRecord& record, bool orientation, Bodies& bodies) {
  bodies.id.push_back(BodyId{record.id});
  bodies.x.push_back({record.x[0], record.x[1], record.x[2]});
  bodies.radius.push_back(record.radius);
  Velocity v;
  std::copy_n(record.u, 3, v.u);
  std::copy_n(record.w, 3, v.w);
  v.inv_mass = record.inv_mass;
  v.spin_mobility = record.spin_mobility;
  bodies.velocity.push_back(v);
  if (orientation)
    bodies.orientation.push_back(
        {record.orientation[0], record.orientation[1], record.orientation[2], record.orientation[3]});
}

/// Points to balance: the candidates there are; in the beginning, the bodies.
PartitionPoints points_to_cut(const Decomposition& decomposition, const Bodies& bodies,
                              const Candidates& candidates, std::int64_t all_candidates) {
  PartitionPoints points;
  if (all_candidates > 0) {
    points = candidate_points(bodies.x, candidates.grain_pairs, candidates.wall_pairs);
    // A weight counts in 64ths, so that 2^31 of them are enough for many candidates.
    for (const Vec3& x : decomposition.cost.empty() ? std::vector<Vec3>() : points.x)
      points.weight.push_back(static_cast<std::int32_t>(std::lround(
          64 * std::clamp(decomposition.cost[at(decomposition.partition.subdomain_of(x))], 0.1, 10.0))));
    return points;
  }
  for (std::size_t s = 0; s < bodies.size(); ++s)
    if (counts(decomposition, s)) points.x.push_back(bodies.x[s]);
  points.half.assign(points.x.size(), Vec3::Zero());
  return points;
}

std::vector<std::vector<BodyRecord>> send_to_surroundings(const Decomposition& decomposition,
                                                          const graph::Communicator& ranks,
                                                          const Bodies& bodies,
                                                          std::span<const double> reach) {
  std::vector<std::vector<BodyRecord>> to(static_cast<std::size_t>(ranks.ranks()));
  if (ranks.ranks() == 1) {
    to[0].reserve(bodies.size());
    for (std::size_t s = 0; s < bodies.size(); ++s)
      if (counts(decomposition, s)) to[0].push_back(record_of(decomposition, bodies, reach, s));
    return to;
  }
  double largest[1] = {0};
  for (double r : reach) largest[0] = std::max(largest[0], r);
  ranks.max(largest);
  std::vector<std::size_t> sent(to.size(), std::numeric_limits<std::size_t>::max());
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    if (!counts(decomposition, s)) continue;
    const BodyRecord record = record_of(decomposition, bodies, reach, s);
    for (std::int32_t subdomain : subdomains_within(decomposition.partition, bodies.x[s], 3 * largest[0])) {
      const std::size_t rank = at(decomposition.rank_of[at(subdomain)]);
      if (sent[rank] == s) continue;
      sent[rank] = s;
      to[rank].push_back(record);
    }
  }
  return ranks.exchange_records(to);
}

/// The impulses of the last steps, in slots of the surroundings. Those whose point has come to a subdomain of
/// another rank go there.
Candidates collect_impulses(const Decomposition& decomposition, const graph::Communicator& ranks,
                            const Surroundings& around, const Bodies& bodies, const Candidates& candidates) {
  const auto components = static_cast<std::size_t>(candidates.components);
  const std::size_t grains = candidates.grain_pairs.size();
  std::vector<std::vector<ImpulseRecord>> to(static_cast<std::size_t>(ranks.ranks()));
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const double* r = &candidates.impulse[components * k];
    if (std::all_of(r, r + components, [](double value) { return value == 0; })) continue;
    ImpulseRecord record{};
    if (k < grains) {
      record.first = static_cast<std::int64_t>(bodies.id[at(candidates.grain_pairs[k].first)]);
      record.second = static_cast<std::int64_t>(bodies.id[at(candidates.grain_pairs[k].second)]);
    } else {
      record.first = static_cast<std::int64_t>(bodies.id[at(candidates.wall_pairs[k - grains].body)]);
      record.second = -1 - std::int64_t{candidates.wall_pairs[k - grains].wall};
    }
    std::copy_n(r, components, record.r);
    const std::int32_t subdomain = decomposition.partition.subdomain_of(point_of(candidates, k, bodies.x));
    to[at(decomposition.rank_of[at(subdomain)])].push_back(record);
  }
  Candidates old;
  old.components = candidates.components;
  std::vector<double> at_walls;
  for (const auto& part : ranks.exchange_records(to))
    for (const ImpulseRecord& record : part) {
      const Slot first = around.find(record.first);
      if (record.second < 0) {
        old.wall_pairs.push_back({static_cast<std::int32_t>(-1 - record.second), first});
        at_walls.insert(at_walls.end(), record.r, record.r + components);
      } else {
        old.grain_pairs.push_back({first, around.find(record.second)});
        old.impulse.insert(old.impulse.end(), record.r, record.r + components);
      }
    }
  old.impulse.insert(old.impulse.end(), at_walls.begin(), at_walls.end());
  std::vector<Slot> same(around.bodies.size());
  std::iota(same.begin(), same.end(), 0);
  renumber(old, same);
  return old;
}

/// Copies that stand in a subdomain now and did not before.
std::int64_t arrivals(std::span<const BodyId> before, std::span<const BodyId> now) {
  const auto sorted = [](std::span<const BodyId> ids) {
    std::vector<BodyId> copy(ids.begin(), ids.end());
    std::sort(copy.begin(), copy.end());
    return copy;
  };
  const std::vector<BodyId> a = sorted(before), b = sorted(now);
  std::int64_t count = 0;
  auto old = a.begin();
  for (BodyId id : b) {
    while (old != a.end() && *old < id) ++old;
    if (old == a.end() || *old != id) ++count;
  }
  return count;
}

}  // namespace

int chunk_target(std::size_t candidates) {
  return static_cast<int>(std::clamp<std::size_t>(candidates / 64, 48, 320));
}

Slot Surroundings::find(std::int64_t id) const {
  const auto found =
      std::lower_bound(by_id.begin(), by_id.end(), id,
                       [](const auto& entry, std::int64_t wanted) { return entry.first < wanted; });
  return found != by_id.end() && found->first == id ? found->second : -1;
}

Decomposition make_decomposition(const DecompositionSettings& settings, const graph::Communicator& ranks) {
  Decomposition decomposition;
  const std::int32_t subdomains = settings.subdomains > 0 ? settings.subdomains : ranks.ranks();
  if (subdomains < ranks.ranks())
    throw std::invalid_argument(fmt::format(
        "{} ranks for {} subdomains: a rank without a subdomain has nothing to do. Start fewer ranks or "
        "set decomposition.subdomains to {} or more",
        ranks.ranks(), subdomains, ranks.ranks()));
  decomposition.partition.subdomains = subdomains;
  for (std::int32_t e = 0; e < subdomains; ++e) {
    const auto rank = static_cast<std::int32_t>(std::int64_t{e} * ranks.ranks() / subdomains);
    decomposition.rank_of.push_back(rank);
    if (rank == ranks.rank()) decomposition.here.push_back(e);
  }
  decomposition.slot_begin.assign(decomposition.here.size() + 1, 0);
  return decomposition;
}

Surroundings collect_surroundings(Decomposition& decomposition, const DecompositionSettings& settings,
                                  const graph::Communicator& ranks, const Bodies& bodies,
                                  std::span<const double> reach, const Candidates& candidates,
                                  bool partition_anew) {
  if (partition_anew) {
    std::int64_t all[1] = {static_cast<std::int64_t>(candidates.size())};
    ranks.sum(all);
    const Partition before = decomposition.partition;
    const bool first = before.tree.cuts.empty() && before.table.subdomain.empty();
    PartitionOptions options;
    options.kind = settings.partitioner;
    options.subdomains = before.subdomains;
    for (std::size_t axis = 0; axis < 3; ++axis)
      options.boxes[axis] = static_cast<std::int32_t>(settings.boxes[axis]);
    options.previous = first ? nullptr : &before;
    decomposition.partition = make_partition(points_to_cut(decomposition, bodies, candidates, all[0]),
                                             options, reduction_over(ranks));
  }
  std::vector<std::pair<std::uint64_t, const BodyRecord*>> order;
  const auto from = send_to_surroundings(decomposition, ranks, bodies, reach);
  for (const auto& part : from)
    for (const BodyRecord& record : part) {
      const auto q = decomposition.partition.frame.coordinates({record.x[0], record.x[1], record.x[2]});
      order.emplace_back(morton_key(q[0], q[1], q[2]), &record);
    }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second->id < b.second->id;
  });
  Surroundings around;
  const bool orientation = decomposition.orientation;
  for (const auto& [key, record] : order) {
    around.by_id.emplace_back(record->id, static_cast<Slot>(around.bodies.size()));
    append(*record, orientation, around.bodies);
    around.reach.push_back(record->reach);
  }
  std::sort(around.by_id.begin(), around.by_id.end());
  return around;
}

std::vector<CandidateGroup> distribute(Decomposition& decomposition, const DecompositionSettings& settings,
                                       const graph::Communicator& ranks, const Surroundings& around,
                                       const Candidates& found, std::span<const char> glued, Bodies& bodies,
                                       Candidates& candidates) {
  const Partition& partition = decomposition.partition;
  const std::size_t grains = found.grain_pairs.size();
  Candidates matched = found;
  match_impulses(collect_impulses(decomposition, ranks, around, bodies, candidates), matched);

  std::vector<std::int32_t> subdomain(found.size()), home;
  for (std::size_t k = 0; k < found.size(); ++k)
    subdomain[k] = partition.subdomain_of(point_of(found, k, around.bodies.x));
  for (const Vec3& x : around.bodies.x) home.push_back(partition.subdomain_of(x));
  const BodySubdomains standings =
      grain_subdomains(around.bodies.size(), found.grain_pairs, found.wall_pairs, subdomain, home);
  const std::int32_t hubs = settings.exchange == ExchangeScheme::ccs ? 2 : 9;
  std::vector<SubdomainInterface> interfaces =
      build_interfaces(standings, around.bodies.id, decomposition.here, hubs);

  // The copies.
  Bodies copies;
  Decomposition next;
  next.slot_begin.push_back(0);
  std::int64_t sums[3] = {0, 0, 0};  // arrivals
  const bool orientation = decomposition.orientation;
  const bool split = settings.coupling == Coupling::nscdd;
  for (std::size_t e = 0; e < interfaces.size(); ++e) {
    const SubdomainInterface& interface = interfaces[e];
    for (std::size_t k = 0; k < interface.bodies.size(); ++k) {
      const std::size_t b = at(interface.bodies[k]);
      const std::int32_t m = interface.multiplicity[k];
      if (m > std::numeric_limits<std::uint16_t>::max())
        throw std::runtime_error(fmt::format("body {} stands in {} subdomains; use fewer subdomains",
                                             static_cast<std::int64_t>(around.bodies.id[b]), m));
      copies.id.push_back(around.bodies.id[b]);
      copies.x.push_back(around.bodies.x[b]);
      copies.radius.push_back(around.bodies.radius[b]);
      Velocity v = around.bodies.velocity[b];
      next.whole.push_back({v.inv_mass, v.spin_mobility});
      if (split) {
        v.inv_mass *= m;
        v.spin_mobility *= m;
      }
      copies.velocity.push_back(v);
      if (orientation) copies.orientation.push_back(around.bodies.orientation[b]);
      next.multiplicity.push_back(static_cast<std::uint16_t>(m));
      next.counts.push_back(standings.of(b).front() == interface.subdomain ? 1 : 0);
    }
    next.slot_begin.push_back(copies.size());
    const std::size_t begin = decomposition.slot_begin[e], end = decomposition.slot_begin[e + 1];
    sums[0] += arrivals(std::span(bodies.id).subspan(begin, end - begin),
                        std::span(copies.id).subspan(next.slot_begin[e]));
  }

  // The candidates: grain pairs by subdomain, those at the interface first; then wall pairs by wall.
  std::vector<std::int32_t> local_of(at(partition.subdomains), -1);
  for (std::size_t e = 0; e < decomposition.here.size(); ++e)
    local_of[at(decomposition.here[e])] = static_cast<std::int32_t>(e);
  struct Key {
    std::int32_t wall, local, inner, candidate;
  };
  std::vector<Key> keys;
  std::vector<std::int64_t> load(at(partition.subdomains), 0);
  for (std::size_t k = 0; k < found.size(); ++k) {
    const std::int32_t local = local_of[at(subdomain[k])];
    if (local < 0) continue;
    ++load[at(subdomain[k])];
    const std::int32_t wall = k < grains ? -1 : found.wall_pairs[k - grains].wall;
    const bool shared = k < grains ? standings.multiplicity(at(found.grain_pairs[k].first)) > 1 ||
                                         standings.multiplicity(at(found.grain_pairs[k].second)) > 1
                                   : glued[at(wall)] != 0 ||
                                         standings.multiplicity(at(found.wall_pairs[k - grains].body)) > 1;
    keys.push_back({wall, local, shared ? 0 : 1, static_cast<std::int32_t>(k)});
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    if (a.wall != b.wall) return a.wall < b.wall;
    if (a.local != b.local) return a.local < b.local;
    return a.inner != b.inner ? a.inner < b.inner : a.candidate < b.candidate;
  });
  ranks.sum(load);
  // As large as without subdomains: small chunks have poor batches, and subdomains run beside one another.
  const int target =
      chunk_target(static_cast<std::size_t>(std::accumulate(load.begin(), load.end(), std::int64_t{0})));
  // Slot of a body in its subdomain: bodies of an interface stand in the order of the surroundings.
  const auto slot_in = [&](std::int32_t local, Slot body) {
    const auto& list = interfaces[at(local)].bodies;
    return static_cast<Slot>(next.slot_begin[at(local)]) +
           static_cast<Slot>(std::lower_bound(list.begin(), list.end(), body) - list.begin());
  };
  Candidates cut;
  cut.components = found.components;
  const auto components = static_cast<std::size_t>(found.components);
  std::vector<CandidateGroup> groups;
  const Key* last = nullptr;
  for (const Key& key : keys) {
    if (!last || key.wall != last->wall || key.local != last->local || key.inner != last->inner) {
      const auto begin = static_cast<std::int32_t>(cut.size());
      groups.push_back({begin, begin, key.wall, key.local, key.inner == 0, target});
    }
    last = &key;
    const std::size_t k = at(key.candidate);
    if (k < grains)
      cut.grain_pairs.push_back(
          {slot_in(key.local, found.grain_pairs[k].first), slot_in(key.local, found.grain_pairs[k].second)});
    else
      cut.wall_pairs.push_back({key.wall, slot_in(key.local, found.wall_pairs[k - grains].body)});
    for (std::size_t c = 0; c < components; ++c) cut.impulse.push_back(matched.impulse[components * k + c]);
    ++groups.back().end;
  }
  ranks.sum(sums);
  decomposition.migrants = decomposition.interfaces.empty() ? 0 : sums[0];
  decomposition.imbalance = imbalance(load);
  decomposition.slot_begin = std::move(next.slot_begin);
  decomposition.multiplicity = std::move(next.multiplicity);
  decomposition.counts = std::move(next.counts);
  decomposition.whole = std::move(next.whole);
  decomposition.interfaces = std::move(interfaces);
  bodies = std::move(copies);
  candidates = std::move(cut);
  return groups;
}

std::size_t memory_used(const Decomposition& decomposition) {
  std::size_t bytes =
      memory_used(decomposition.partition) + decomposition.multiplicity.capacity() * sizeof(std::uint16_t) +
      decomposition.counts.capacity() + decomposition.whole.capacity() * sizeof(std::array<double, 2>);
  for (const SubdomainInterface& interface : decomposition.interfaces) bytes += memory_used(interface);
  return bytes;
}

}  // namespace talus
