#include "partition/interface.hpp"

#include <algorithm>
#include <unordered_map>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

/// The shared grains of an interface in order of id, with their owners and hubs.
void list_shared(SubdomainInterface& here, const BodySubdomains& incidences, std::span<const BodyId> id,
                 std::int32_t hub_multiplicity) {
  for (std::size_t k = 0; k < here.bodies.size(); ++k)
    if (here.multiplicity[k] > 1) here.shared.push_back(static_cast<std::int32_t>(k));
  const auto id_of = [&](std::int32_t k) { return id[at(here.bodies[at(k)])]; };
  std::sort(here.shared.begin(), here.shared.end(),
            [&](std::int32_t a, std::int32_t b) { return id_of(a) < id_of(b); });
  for (std::size_t s = 0; s < here.shared.size(); ++s) {
    const std::int32_t k = here.shared[s];
    here.owner.push_back(incidences.of(at(here.bodies[at(k)])).front());
    if (here.multiplicity[at(k)] >= hub_multiplicity) here.hubs.push_back(static_cast<std::int32_t>(s));
  }
}

/// Exchange lists of all neighbours, and where the copies come from. A grain's place in the list of E with F
/// is its place in the list of F with E, as both hold the same grains in the same order.
void list_exchanges(SubdomainInterface& here, const BodySubdomains& incidences,
                    std::int32_t hub_multiplicity) {
  std::vector<std::pair<SubdomainId, std::int32_t>> ties;  // (other subdomain, index into shared)
  for (std::size_t s = 0; s < here.shared.size(); ++s) {
    const std::int32_t k = here.shared[s];
    if (here.multiplicity[at(k)] >= hub_multiplicity) continue;
    for (const SubdomainId other : incidences.of(at(here.bodies[at(k)])))
      if (other != here.subdomain) ties.emplace_back(other, static_cast<std::int32_t>(s));
  }
  std::sort(ties.begin(), ties.end());

  here.copies_begin.assign(1, 0);
  for (std::int32_t k : here.shared) {
    const std::int32_t m = here.multiplicity[at(k)];
    here.copies_begin.push_back(here.copies_begin.back() + (m < hub_multiplicity ? m : 0));
  }
  here.copies.resize(at(here.copies_begin.back()));
  // Ties come by ascending subdomain, so the copies of each grain are filled in that order, its own copy at
  // the place of its subdomain.
  std::vector<std::int32_t> filled(here.copies_begin.begin(), here.copies_begin.end() - 1);
  std::vector<char> own(here.shared.size(), 0);
  const auto put_own = [&](std::size_t s) {
    own[s] = 1;
    here.copies[at(filled[s]++)] = {-1, {}};
  };
  for (const auto& [other, index] : ties) {
    const std::size_t s = at(index);
    if (here.neighbours.empty() || here.neighbours.back().subdomain != other) {
      const auto begin = static_cast<std::int32_t>(here.exchange.size());
      here.neighbours.push_back({other, begin, begin});
    }
    Neighbour& neighbour = here.neighbours.back();
    if (other > here.subdomain && own[s] == 0) put_own(s);
    here.copies[at(filled[s]++)] = {static_cast<std::int32_t>(here.neighbours.size() - 1),
                                    MessagePlace(neighbour.end - neighbour.begin)};
    here.exchange.push_back(here.shared[s]);
    ++neighbour.end;
  }
  for (std::size_t s = 0; s < here.shared.size(); ++s)
    if (own[s] == 0 && here.copies_begin[s] < here.copies_begin[s + 1]) put_own(s);
}

}  // namespace

BodySubdomains collect_incidences(std::size_t bodies, std::span<const BodyIncidence> incidences) {
  std::vector<std::int32_t> begin(bodies + 1, 0);
  for (const BodyIncidence& incidence : incidences) ++begin[at(incidence.body) + 1];
  for (std::size_t k = 0; k < bodies; ++k) begin[k + 1] += begin[k];
  std::vector<SubdomainId> all(incidences.size());
  std::vector<std::int32_t> next(begin.begin(), begin.end() - 1);
  for (const BodyIncidence& incidence : incidences) all[at(next[at(incidence.body)]++)] = incidence.subdomain;

  BodySubdomains result;
  result.begin.assign(bodies + 1, 0);
  for (std::size_t k = 0; k < bodies; ++k) {
    const auto first = all.begin() + begin[k], last = all.begin() + begin[k + 1];
    std::sort(first, last);
    result.subdomain.insert(result.subdomain.end(), first, std::unique(first, last));
    result.begin[k + 1] = static_cast<std::int32_t>(result.subdomain.size());
  }
  return result;
}

BodySubdomains grain_subdomains(std::size_t grains, std::span<const GrainPair> grain_pairs,
                                std::span<const WallPair> wall_pairs, std::span<const SubdomainId> subdomain,
                                std::span<const SubdomainId> home) {
  // Most grains stand in one subdomain: repetitions of its first incidence are not listed.
  std::vector<BodyIncidence> incidences;
  incidences.reserve(grains);
  std::vector<SubdomainId> first(grains);
  const auto stands = [&](Slot body, SubdomainId in) {
    SubdomainId& seen = first[at(body)];
    if (seen == in) return;
    if (seen.none()) seen = in;
    incidences.push_back({body, in});
  };
  for (std::size_t k = 0; k < grain_pairs.size(); ++k) {
    stands(grain_pairs[k].first, subdomain[k]);
    stands(grain_pairs[k].second, subdomain[k]);
  }
  for (std::size_t k = 0; k < wall_pairs.size(); ++k)
    stands(wall_pairs[k].body, subdomain[grain_pairs.size() + k]);
  for (std::size_t k = 0; k < home.size(); ++k)
    if (first[k].none()) incidences.push_back({static_cast<Slot>(k), home[k]});
  return collect_incidences(grains, incidences);
}

BodySubdomains wall_subdomains(std::size_t walls, std::span<const WallPair> wall_pairs,
                               std::span<const SubdomainId> subdomain) {
  std::vector<BodyIncidence> incidences;
  for (std::size_t k = 0; k < wall_pairs.size(); ++k)
    incidences.push_back({wall_pairs[k].wall, subdomain[k]});
  return collect_incidences(walls, incidences);
}

std::vector<SubdomainInterface> build_interfaces(const BodySubdomains& incidences, std::span<const BodyId> id,
                                                 std::span<const SubdomainId> here,
                                                 std::int32_t hub_multiplicity) {
  std::vector<SubdomainInterface> interfaces(here.size());
  std::unordered_map<SubdomainId, std::size_t> place;  // looked up only; its order reaches no result
  for (std::size_t k = 0; k < here.size(); ++k) {
    interfaces[k].subdomain = here[k];
    place.emplace(here[k], k);
  }
  for (std::size_t body = 0; body < incidences.bodies(); ++body)
    for (const SubdomainId subdomain : incidences.of(body)) {
      const auto found = place.find(subdomain);
      if (found == place.end()) continue;
      interfaces[found->second].bodies.push_back(static_cast<Slot>(body));
      interfaces[found->second].multiplicity.push_back(incidences.multiplicity(body));
    }
  for (SubdomainInterface& interface : interfaces) {
    list_shared(interface, incidences, id, hub_multiplicity);
    list_exchanges(interface, incidences, hub_multiplicity);
  }
  return interfaces;
}

std::size_t memory_used(const BodySubdomains& incidences) {
  return (incidences.begin.size() + incidences.subdomain.size()) * sizeof(std::int32_t);
}

std::size_t memory_used(const SubdomainInterface& interface) {
  return (interface.bodies.size() + interface.multiplicity.size() + interface.shared.size() +
          interface.owner.size() + interface.exchange.size() + interface.copies_begin.size() +
          interface.hubs.size()) *
             sizeof(std::int32_t) +
         interface.neighbours.size() * sizeof(Neighbour) + interface.copies.size() * sizeof(CopySource);
}

}  // namespace talus
