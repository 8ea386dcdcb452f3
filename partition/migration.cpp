#include "partition/migration.hpp"

#include <algorithm>
#include <tuple>

namespace talus {

namespace {

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

}  // namespace

Migration plan_migration(const BodySubdomains& before, const BodySubdomains& now, std::span<const BodyId> id,
                         std::span<const std::int32_t> rank_of_subdomain) {
  Migration plan;
  std::vector<std::int32_t> reached;  // ranks that hold the body, or to which its data are under way
  for (std::size_t body = 0; body < now.bodies(); ++body) {
    const auto old_set = before.of(body), new_set = now.of(body);
    const auto slot = static_cast<Slot>(body);
    for (std::int32_t subdomain : old_set)
      if (!std::binary_search(new_set.begin(), new_set.end(), subdomain))
        plan.departures.push_back({slot, subdomain});
    reached.clear();
    for (std::int32_t subdomain : old_set) reached.push_back(rank_of_subdomain[at(subdomain)]);
    bool migrates = false;
    for (std::int32_t to : new_set) {
      if (std::binary_search(old_set.begin(), old_set.end(), to)) continue;
      migrates = true;
      const std::int32_t rank = rank_of_subdomain[at(to)];
      const auto near = std::find_if(old_set.begin(), old_set.end(), [&](std::int32_t subdomain) {
        return rank_of_subdomain[at(subdomain)] == rank;
      });
      const std::int32_t from = old_set.empty() ? -1 : near != old_set.end() ? *near : old_set.front();
      const bool travels = from >= 0 && std::find(reached.begin(), reached.end(), rank) == reached.end();
      if (travels) reached.push_back(rank);
      plan.arrivals.push_back({slot, from, to, travels});
    }
    plan.migrants += migrates;
  }
  std::sort(plan.arrivals.begin(), plan.arrivals.end(), [&](const BodyMove& a, const BodyMove& b) {
    return std::tuple(a.from, a.to, id[at(a.body)]) < std::tuple(b.from, b.to, id[at(b.body)]);
  });
  std::sort(plan.departures.begin(), plan.departures.end(), [&](const Standing& a, const Standing& b) {
    return std::tuple(a.subdomain, id[at(a.body)]) < std::tuple(b.subdomain, id[at(b.body)]);
  });
  return plan;
}

std::vector<CandidateMove> plan_candidate_moves(std::span<const std::int32_t> before,
                                                std::span<const std::int32_t> now) {
  std::vector<CandidateMove> moves;
  for (std::size_t k = 0; k < now.size(); ++k)
    if (before[k] != now[k]) moves.push_back({static_cast<std::int32_t>(k), before[k], now[k]});
  std::sort(moves.begin(), moves.end(), [](const CandidateMove& a, const CandidateMove& b) {
    return std::tuple(a.from, a.to, a.candidate) < std::tuple(b.from, b.to, b.candidate);
  });
  return moves;
}

}  // namespace talus
