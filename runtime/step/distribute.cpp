/// From the candidates that were found to the groups of this rank, and the impulses that follow them.

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

#include "kernels/bodies/index.hpp"
#include "kernels/bodies/release.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "partition/subdomain_colours.hpp"
#include "runtime/step/decomposition.hpp"
#include "runtime/step/detail/copies.hpp"

namespace talus {

namespace {

/// A warm start on its way.
struct ImpulseRecord {
  std::int64_t first;
  std::int64_t second;   ///< -1 - wall at a wall
  std::int64_t feature;  ///< of the wall; between bodies Candidates::balls, or 0
  double r[static_cast<std::size_t>(ImpulseKind::rolling)];  ///< a row of KeptImpulses
};

/// The midpoint decides; at a wall the centre.
Vec3 point_of(const Candidates& candidates, std::size_t k, std::span<const Vec3> x, const Domain& domain) {
  const std::size_t grains = candidates.grain_pairs.size();
  if (k >= grains) return x[at(candidates.wall_pairs[k - grains].body)];
  const GrainPair& pair = candidates.grain_pairs[k];
  return domain.midpoint(x[at(pair.first)], x[at(pair.second)]);
}

/// The impulses of the last step, with slots of the surroundings. Those whose point of contact now lies in a
/// subdomain of another rank are sent there; `candidates` are freed.
Candidates collect_impulses(const Decomposition& decomposition, const graph::Communicator& ranks,
                            const Surroundings& around, const RankSample& sample) {
  const Bodies& bodies = sample.bodies;
  Candidates candidates = std::move(sample.candidates);
  const std::size_t grains = candidates.grain_pairs.size();
  Candidates old;
  old.grain_pairs.reserve(grains);
  old.impulse = KeptImpulses(candidates.impulse.kind());
  old.impulse.reserve(candidates.size());
  KeptImpulses at_walls(candidates.impulse.kind());
  const bool clumps = decomposition.shapes;
  std::vector<std::vector<ImpulseRecord>> to(static_cast<std::size_t>(ranks.ranks()));
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const std::span<const double> r = std::as_const(candidates.impulse).row(k);
    if (std::ranges::all_of(r, [](double value) { return value == 0; })) continue;
    const bool wall = k >= grains;
    const GrainPair pair = wall ? GrainPair{} : candidates.grain_pairs[k];
    const WallPair at_wall = wall ? candidates.wall_pairs[k - grains] : WallPair{};
    const std::int32_t rank = ranks.ranks() == 1 ? 0
                                                 : decomposition.rank_of[decomposition.partition.subdomain_of(
                                                       point_of(candidates, k, bodies.x, sample.domain))];
    if (rank == ranks.rank()) {
      if (wall)
        old.wall_pairs.push_back({at_wall.wall, around.of_slot[at(at_wall.body)], at_wall.feature});
      else
        old.grain_pairs.push_back({around.of_slot[at(pair.first)], around.of_slot[at(pair.second)]});
      if (clumps && !wall) old.balls.push_back(candidates.balls[k]);
      (wall ? at_walls : old.impulse).push_back(r);
      continue;
    }
    ImpulseRecord record{};
    record.first = static_cast<std::int64_t>(bodies.id[at(wall ? at_wall.body : pair.first)]);
    record.second =
        wall ? -1 - std::int64_t{at_wall.wall} : static_cast<std::int64_t>(bodies.id[at(pair.second)]);
    record.feature = clumps && !wall ? candidates.balls[k] : at_wall.feature;
    std::ranges::copy(r, record.r);
    to[at(rank)].push_back(record);
  }
  candidates = {};
  for (const auto& part : ranks.exchange_records(std::move(to)))
    for (const ImpulseRecord& record : part) {
      const Slot first = around.find(record.first);
      const bool wall = record.second < 0;
      if (wall)
        old.wall_pairs.push_back({static_cast<std::int32_t>(-1 - record.second), first,
                                  static_cast<std::int32_t>(record.feature)});
      else
        old.grain_pairs.push_back({first, around.find(record.second)});
      if (clumps && !wall) old.balls.push_back(static_cast<std::uint16_t>(record.feature));
      (wall ? at_walls : old.impulse).push_back(record.r);
    }
  old.impulse.append(at_walls);
  std::vector<Slot> same(around.bodies.size());
  std::iota(same.begin(), same.end(), 0);
  renumber(old, same);
  return old;
}

/// The candidates of this rank in the order of its groups: grain pairs by subdomain, those at the interface
/// first; then wall pairs by wall, by subdomain, and those at the interface first again.
struct OwnCandidates {
  std::vector<std::int32_t> candidate;  ///< among the found
  std::vector<std::size_t> begin;       ///< of group ((wall + 1) x here + local) x 2 + inner, wall -1: grains
};

OwnCandidates sort_own(const Decomposition& decomposition, const Candidates& found,
                       std::span<const SubdomainId> subdomain, const BodySubdomains& incidences,
                       std::span<const char> glued) {
  const std::size_t grains = found.grain_pairs.size(), here = decomposition.here.size();
  Per<SubdomainId, SubdomainPlace> place_of(at(decomposition.partition.subdomains));
  for (const SubdomainPlace e : decomposition.here.indices()) place_of[decomposition.here[e]] = e;
  const auto shared = [&](Slot body) { return incidences.multiplicity(at(body)) > 1; };
  std::vector<std::int32_t> group(found.size(), -1);
  OwnCandidates own;
  own.begin.assign(2 * here * (glued.size() + 1) + 1, 0);
  for (std::size_t k = 0; k < found.size(); ++k) {
    const SubdomainPlace local = place_of[subdomain[k]];
    if (local.none()) continue;
    const std::int32_t wall = k < grains ? -1 : found.wall_pairs[k - grains].wall;
    const bool boundary = k < grains
                              ? shared(found.grain_pairs[k].first) || shared(found.grain_pairs[k].second)
                              : glued[at(wall)] != 0 || shared(found.wall_pairs[k - grains].body);
    group[k] = ((wall + 1) * static_cast<std::int32_t>(here) + local.value()) * 2 + (boundary ? 0 : 1);
    ++own.begin[at(group[k]) + 1];
  }
  std::partial_sum(own.begin.begin(), own.begin.end(), own.begin.begin());
  own.candidate.resize(own.begin.back());
  // Candidates come in ascending order, so that counting sorts them.
  std::vector<std::size_t> next = own.begin;
  for (std::size_t k = 0; k < found.size(); ++k)
    if (group[k] >= 0) own.candidate[next[at(group[k])]++] = static_cast<std::int32_t>(k);
  return own;
}

/// The subdomain colours, none where there is a hub. Collective.
void settle_colours(Decomposition& decomposition, const graph::Communicator& ranks,
                    const BodySubdomains& incidences, std::int32_t hubs) {
  const auto is_here = [&](SubdomainId e) { return decomposition.rank_of[e] == ranks.rank(); };
  std::map<std::pair<SubdomainId, SubdomainId>, std::int32_t> shared;
  double hub[1] = {0};
  for (std::size_t b = 0; b < incidences.bodies(); ++b) {
    const auto stands = incidences.of(b);
    for (const SubdomainId e : stands) {
      if (stands.size() == 1 || !is_here(e)) continue;
      if (incidences.multiplicity(b) >= hubs) hub[0] = 1;
      for (const SubdomainId other : stands)
        if (other != e && hub[0] == 0) ++shared[{e, other}];
    }
  }
  ranks.max(hub);
  std::vector<Tie> ties;
  if (hub[0] == 0)
    for (const auto& [pair, grains] : shared) ties.push_back({pair.first, pair.second, grains});
  decomposition.subdomain_colour = choose_subdomain_colours(decomposition.partition.subdomains,
                                                            ranks.gather_records(std::span<const Tie>(ties)));
}

/// Contacts at glued walls of grains that stand in several subdomains go where the grain's subdomain colour
/// comes first: a later subdomain colour then has its walls swept, and can tell, before it takes over what
/// others did to its grains. Collective: impulses of what goes to another rank follow.
void move_wall_contacts(const Decomposition& decomposition, const graph::Communicator& ranks,
                        const BodySubdomains& incidences, const Surroundings& around, FoundCandidates& among,
                        std::vector<SubdomainId>& subdomain) {
  Candidates& found = among.candidates;
  const std::size_t grains = found.grain_pairs.size();
  std::vector<std::vector<ImpulseRecord>> to(static_cast<std::size_t>(ranks.ranks()));
  for (std::size_t k = grains; k < found.size(); ++k) {
    const WallPair& pair = found.wall_pairs[k - grains];
    if (among.glued[at(pair.wall)] == 0) continue;
    const auto stands = incidences.of(at(pair.body));
    const SubdomainId first = *std::ranges::min_element(
        stands, {}, [&](SubdomainId e) { return decomposition.subdomain_colour_of(e); });
    const SubdomainId before = subdomain[k];
    if (decomposition.subdomain_colour_of(first) == decomposition.subdomain_colour_of(before)) continue;
    subdomain[k] = first;
    const std::int32_t from = decomposition.rank_of[before], rank = decomposition.rank_of[first];
    if (from != ranks.rank() || rank == from) continue;
    ImpulseRecord record{};
    record.first = static_cast<std::int64_t>(around.bodies.id[at(pair.body)]);
    record.second = -1 - std::int64_t{pair.wall};
    record.feature = pair.feature;
    std::ranges::copy(found.impulse.row(k), record.r);
    to[at(rank)].push_back(record);
  }
  for (const auto& part : ranks.exchange_records(std::move(to)))
    for (const ImpulseRecord& record : part) {
      const WallPair pair{static_cast<std::int32_t>(-1 - record.second), around.find(record.first),
                          static_cast<std::int32_t>(record.feature)};
      // Walls of finite mass are planes, where the layer of a pair is its feature: the ball of a clump.
      const auto order = [](const WallPair& other) {
        return std::tuple{other.wall, other.feature, other.body};
      };
      const auto place = std::ranges::lower_bound(found.wall_pairs, order(pair), {}, order);
      const auto k = grains + static_cast<std::size_t>(place - found.wall_pairs.begin());
      found.impulse.set(k, record.r);
    }
}

/// What the groups depend on, besides the candidates themselves.
struct GroupRules {
  const Per<SubdomainId, std::int64_t>& load;  ///< candidates
  std::int64_t all;                            ///< their sum
  std::span<const char> glued;                 ///< per wall: of finite mass
};

/// The groups of this rank, and in `cut` their candidates between the slots of the copies, with impulses.
/// `bodies`: how many there are around.
std::vector<CandidateGroup> cut_groups(const Decomposition& decomposition, const Candidates& found,
                                       const OwnCandidates& own, const GroupRules& given, std::size_t bodies,
                                       Candidates& cut) {
  // Of the bodies of the subdomain at hand.
  std::vector<Slot> slot(bodies);
  cut.impulse = KeptImpulses(found.impulse.kind());
  cut.impulse.reserve(own.candidate.size());
  cut.grain_pairs.reserve(own.begin[2 * decomposition.here.size()]);
  cut.balls.reserve(found.balls.empty() ? 0 : own.begin[2 * decomposition.here.size()]);
  std::vector<CandidateGroup> groups;
  for (std::size_t group = 0; group + 1 < own.begin.size(); ++group) {
    const auto begin = static_cast<std::int32_t>(own.begin[group]);
    const auto end = static_cast<std::int32_t>(own.begin[group + 1]);
    if (begin == end) continue;
    const SubdomainPlace local(group / 2 % decomposition.here.size());
    const auto wall = static_cast<std::int32_t>(group / 2 / decomposition.here.size()) - 1;
    const ChunkSide side = group % 2 == 1                            ? ChunkSide::inside
                           : wall >= 0 && given.glued[at(wall)] != 0 ? ChunkSide::wall
                           : decomposition.subdomain_colour_of(decomposition.here[local]) > 0
                               ? ChunkSide::late
                               : ChunkSide::border;
    // Small subdomains have no smaller chunks: these have poor groups, and subdomains run beside one another.
    const int target = chunk_target(given.all, given.load[decomposition.here[local]]);
    groups.push_back({begin, end, wall, local.value(), side, target});
    const std::size_t first_at_wall = cut.wall_pairs.size();
    const auto push_at_wall = [&](const WallPair& pair, std::int32_t place) {
      cut.wall_pairs.push_back({wall, slot[at(pair.body)], pair.feature});
      const std::size_t last = cut.wall_pairs.size() - 1;
      if (last == first_at_wall || !begins_layer(cut.wall_pairs, last)) return;
      groups.back().end = place;
      groups.push_back({place, end, wall, local.value(), side, target});
    };
    auto next = static_cast<Slot>(decomposition.slots_of(local).begin);
    for (Slot body : decomposition.interfaces[local].bodies) slot[at(body)] = next++;
    for (std::int32_t place = begin; place < end; ++place) {
      const std::size_t k = at(own.candidate[at(place)]);
      if (wall < 0)
        cut.grain_pairs.push_back(
            {slot[at(found.grain_pairs[k].first)], slot[at(found.grain_pairs[k].second)]});
      else
        push_at_wall(found.wall_pairs[k - found.grain_pairs.size()], place);
      if (wall < 0 && !found.balls.empty()) cut.balls.push_back(found.balls[k]);
      cut.impulse.push_back(found.impulse.row(k));
    }
  }
  return groups;
}

}  // namespace

std::vector<CandidateGroup> distribute(Decomposition& decomposition, const DecompositionSettings& settings,
                                       const graph::Communicator& ranks, Surroundings& around,
                                       FoundCandidates among, const RankSample& sample) {
  const Partition& partition = decomposition.partition;
  Candidates& found = among.candidates;
  const Candidates old = collect_impulses(decomposition, ranks, around, sample);
  match_impulses(among.begun_from ? *among.begun_from : old, found);
  sample.candidates = {};
  release(sample.bodies.x);

  Per<SubdomainId, std::int64_t> load(at(partition.subdomains), 0);
  OwnCandidates own;
  const std::vector<std::size_t> slot_begin_before = decomposition.slot_begin;
  const bool first = decomposition.interfaces.empty();
  {
    std::vector<SubdomainId> subdomain(found.size()), home;
    for (std::size_t k = 0; k < found.size(); ++k)
      subdomain[k] = partition.subdomain_of(point_of(found, k, around.bodies.x, sample.domain));
    for (const Vec3& x : around.bodies.x) home.push_back(partition.subdomain_of(x));
    const auto stand = [&] {
      return grain_subdomains(around.bodies.size(), found.grain_pairs, found.wall_pairs, subdomain, home);
    };
    BodySubdomains incidences = stand();
    const std::int32_t hubs = detail::hubs_from(settings);
    if (settings.coupling == Coupling::alternating) {
      settle_colours(decomposition, ranks, incidences, hubs);
      if (decomposition.in_colours() && std::ranges::find(among.glued, 1) != among.glued.end()) {
        move_wall_contacts(decomposition, ranks, incidences, around, among, subdomain);
        incidences = stand();
      }
    }
    std::vector<SubdomainInterface> interfaces =
        build_interfaces(incidences, around.bodies.id, decomposition.here, hubs);
    decomposition.interfaces.assign(std::move_iterator(interfaces.begin()),
                                    std::move_iterator(interfaces.end()));
    detail::list_copies(decomposition, settings.coupling, incidences, around.bodies.id, hubs);
    own = sort_own(decomposition, found, subdomain, incidences, among.glued);
    for (std::int32_t k : own.candidate) ++load[subdomain[at(k)]];
  }
  ranks.sum(load);
  const std::int64_t all = std::accumulate(load.begin(), load.end(), std::int64_t{0});

  Candidates cut;
  const std::vector<CandidateGroup> groups =
      cut_groups(decomposition, found, own, {load, all, among.glued}, around.bodies.size(), cut);
  own = {};
  found = {};

  Bodies copies = detail::make_copies(decomposition, around.bodies);
  std::int64_t migrants[1] = {detail::arrivals(decomposition, around, slot_begin_before)};
  ranks.sum(migrants);
  decomposition.migrants = first ? 0 : migrants[0];
  decomposition.imbalance = imbalance(load);
  sample.bodies = std::move(copies);
  sample.candidates = std::move(cut);
  return groups;
}

}  // namespace talus
