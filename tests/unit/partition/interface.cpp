#include "partition/interface.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "kernels/bodies/index.hpp"
#include "partition/load_table.hpp"
#include "partition/partitioner.hpp"
#include "runtime/graph/pretend_ranks.hpp"
#include "runtime/step/decomposition.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus {
namespace {

struct Decomposed {
  Bodies bodies;
  std::vector<Wall> walls;
  Candidates candidates;
  std::vector<SubdomainId> subdomain;  // per candidate
  BodySubdomains grains, of_walls;
  std::int32_t subdomains;
};

std::vector<SubdomainId> up_to(std::int32_t n) {
  const FirstNumbers<SubdomainId> all(at(n));
  return {all.begin(), all.end()};
}

std::vector<SubdomainId> ids(std::initializer_list<int> numbers) {
  return {numbers.begin(), numbers.end()};
}

Decomposed decompose(int edge, std::int32_t n, PartitionKind kind) {
  Decomposed d;
  d.subdomains = n;
  d.bodies = test::jittered_lattice(edge, 5);
  d.walls = test::box_of_walls(-0.5, edge - 0.5);
  d.candidates = test::find_candidates(d.bodies, d.walls, 0.05, true);
  const auto points = candidate_points(d.bodies.x, d.candidates.grain_pairs, d.candidates.wall_pairs);
  PartitionOptions options;
  options.kind = kind;
  options.subdomains = n;
  d.subdomain = subdomains_of(make_partition(points, options), points.x);
  d.grains =
      grain_subdomains(d.bodies.size(), d.candidates.grain_pairs, d.candidates.wall_pairs, d.subdomain);
  d.of_walls = wall_subdomains(d.walls.size(), d.candidates.wall_pairs,
                               std::span(d.subdomain).subspan(d.candidates.grain_pairs.size()));
  return d;
}

std::vector<Decomposed> cases() {
  std::vector<Decomposed> list;
  for (PartitionKind kind : {PartitionKind::boxes, PartitionKind::rcb, PartitionKind::metis})
    for (std::int32_t n : {1, 2, 12, 60}) list.push_back(decompose(9, n, kind));
  return list;
}

/// By looking at all candidates of each body in turn.
std::vector<std::set<SubdomainId>> standings_by_brute_force(const Decomposed& d) {
  std::vector<std::set<SubdomainId>> sets(d.bodies.size());
  for (std::size_t k = 0; k < d.candidates.grain_pairs.size(); ++k) {
    sets[at(d.candidates.grain_pairs[k].first)].insert(d.subdomain[k]);
    sets[at(d.candidates.grain_pairs[k].second)].insert(d.subdomain[k]);
  }
  for (std::size_t k = 0; k < d.candidates.wall_pairs.size(); ++k)
    sets[at(d.candidates.wall_pairs[k].body)].insert(d.subdomain[d.candidates.grain_pairs.size() + k]);
  return sets;
}

TEST(BodyIncidences, AreTheSubdomainsOfABodysCandidates) {
  for (const Decomposed& d : cases()) {
    const auto expected = standings_by_brute_force(d);
    for (std::size_t body = 0; body < d.bodies.size(); ++body) {
      const auto in = d.grains.of(body);
      EXPECT_EQ(std::vector<SubdomainId>(in.begin(), in.end()),
                std::vector<SubdomainId>(expected[body].begin(), expected[body].end()));
    }
    for (std::size_t wall = 0; wall < d.walls.size(); ++wall) {
      std::set<SubdomainId> in;
      for (std::size_t k = 0; k < d.candidates.wall_pairs.size(); ++k)
        if (at(d.candidates.wall_pairs[k].wall) == wall)
          in.insert(d.subdomain[d.candidates.grain_pairs.size() + k]);
      EXPECT_EQ(std::vector<SubdomainId>(d.of_walls.of(wall).begin(), d.of_walls.of(wall).end()),
                std::vector<SubdomainId>(in.begin(), in.end()));
    }
  }
}

TEST(BodyIncidences, OfPiecesPutTogetherAreThoseOfTheWhole) {
  const Decomposed d = decompose(8, 12, PartitionKind::rcb);
  const std::size_t half = d.candidates.grain_pairs.size() / 2;
  const std::span pairs(d.candidates.grain_pairs);
  const std::span subdomain(d.subdomain);
  const auto first = grain_subdomains(d.bodies.size(), pairs.first(half), {}, subdomain.first(half));
  const auto second = grain_subdomains(d.bodies.size(), pairs.subspan(half), d.candidates.wall_pairs,
                                       subdomain.subspan(half));
  std::vector<BodyIncidence> sent;
  for (const BodySubdomains* part : {&second, &first})
    for (std::size_t body = part->bodies(); body-- > 0;)
      for (const SubdomainId in : part->of(body)) sent.push_back({static_cast<Slot>(body), in});
  EXPECT_EQ(collect_incidences(d.bodies.size(), sent), d.grains);
}

TEST(BodyIncidences, AGrainWithoutCandidatesStandsInItsHomeOnly) {
  const std::vector<GrainPair> pairs{{0, 2}};
  const std::vector<SubdomainId> subdomain = ids({7}), home = ids({1, 2, 3, 4});
  const BodySubdomains expected{{0, 1, 2, 3, 4}, ids({7, 2, 7, 4})};
  EXPECT_EQ(grain_subdomains(4, pairs, {}, subdomain, home), expected);
  const BodySubdomains nowhere{{0, 1, 1, 2, 2}, ids({7, 7})};
  EXPECT_EQ(grain_subdomains(4, pairs, {}, subdomain), nowhere);
}

TEST(Interface, MultiplicitiesSumToTheCopiesOfAllSubdomains) {
  for (const Decomposed& d : cases()) {
    const auto interfaces = build_interfaces(d.grains, d.bodies.id, up_to(d.subdomains));
    std::vector<double> share(d.bodies.size(), 0);  // sum of B_E^T D B_E: 1 for every body that stands
    std::size_t copies = 0;
    for (const SubdomainInterface& interface : interfaces) {
      copies += interface.bodies.size();
      for (std::size_t k = 0; k < interface.bodies.size(); ++k)
        share[at(interface.bodies[k])] += 1.0 / interface.multiplicity[k];
    }
    std::int64_t multiplicities = 0;
    for (std::size_t body = 0; body < d.bodies.size(); ++body) {
      multiplicities += d.grains.multiplicity(body);
      EXPECT_NEAR(share[body], d.grains.multiplicity(body) > 0 ? 1 : 0, 1e-14);
    }
    EXPECT_EQ(copies, static_cast<std::size_t>(multiplicities));
  }
}

TEST(Interface, BothSidesListTheSameGrainsInOrderOfId) {
  for (const Decomposed& d : cases()) {
    const auto interfaces = build_interfaces(d.grains, d.bodies.id, up_to(d.subdomains));
    std::map<std::pair<SubdomainId, SubdomainId>, std::vector<BodyId>> lists;
    for (const SubdomainInterface& interface : interfaces)
      for (const Neighbour& neighbour : interface.neighbours) {
        std::vector<BodyId> sent;
        for (std::int32_t k = neighbour.begin; k < neighbour.end; ++k)
          sent.push_back(d.bodies.id[at(interface.bodies[at(interface.exchange[at(k)])])]);
        EXPECT_TRUE(std::is_sorted(sent.begin(), sent.end()));
        EXPECT_FALSE(sent.empty());
        EXPECT_TRUE(lists.emplace(std::pair(interface.subdomain, neighbour.subdomain), sent).second);
      }
    for (const auto& [pair, sent] : lists) {
      const auto other = lists.find({pair.second, pair.first});
      ASSERT_NE(other, lists.end());
      EXPECT_EQ(sent, other->second);
    }
  }
}

/// What gluing does: every subdomain sums the copies of its shared grains, from messages, in the order of
/// `copies`. All copies must be met, once, in the same order everywhere.
TEST(Interface, EverySubdomainSumsTheSameCopiesInTheSameOrder) {
  for (const Decomposed& d : cases()) {
    const auto interfaces = build_interfaces(d.grains, d.bodies.id, up_to(d.subdomains));
    for (const SubdomainInterface& here : interfaces)
      for (std::size_t s = 0; s < here.shared.size(); ++s) {
        const Slot body = here.bodies[at(here.shared[s])];
        const auto subdomains = d.grains.of(at(body));
        const auto begin = here.copies_begin[s], end = here.copies_begin[s + 1];
        EXPECT_EQ(here.owner[s], subdomains.front());
        if (subdomains.size() >= 9) {
          EXPECT_EQ(begin, end);
          continue;
        }
        ASSERT_EQ(at(end - begin), subdomains.size());
        for (std::int32_t c = begin; c < end; ++c) {
          const CopySource& copy = here.copies[at(c)];
          const SubdomainId expected = subdomains[at(c - begin)];
          if (copy.neighbour < 0) {
            EXPECT_EQ(expected, here.subdomain);
            continue;
          }
          const SubdomainId other = here.neighbours[at(copy.neighbour)].subdomain;
          EXPECT_EQ(other, expected);
          const SubdomainInterface& there = interfaces[other.at()];
          const auto back = std::find_if(there.neighbours.begin(), there.neighbours.end(),
                                         [&](const Neighbour& n) { return n.subdomain == here.subdomain; });
          ASSERT_NE(back, there.neighbours.end());
          EXPECT_EQ(there.bodies[at(there.exchange[at(back->begin + copy.place.value())])], body);
        }
      }
  }
}

TEST(Interface, TheExampleOfTheHeader) {
  const BodySubdomains incidences{{0, 1, 3, 6}, ids({0, 0, 1, 0, 1, 2})};
  const std::vector<BodyId> id{BodyId{10}, BodyId{11}, BodyId{12}};
  const SubdomainInterface e = build_interfaces(incidences, id, ids({0})).front();
  EXPECT_EQ(e.bodies, (std::vector<Slot>{0, 1, 2}));
  EXPECT_EQ(e.multiplicity, (std::vector<std::int32_t>{1, 2, 3}));
  EXPECT_EQ(e.shared, (std::vector<std::int32_t>{1, 2}));
  ASSERT_EQ(e.neighbours.size(), 2u);
  EXPECT_EQ(e.neighbours[1].begin, 2);
  EXPECT_EQ(e.exchange, (std::vector<std::int32_t>{1, 2, 2}));
  EXPECT_EQ(e.copies_begin, (std::vector<std::int32_t>{0, 2, 5}));
  EXPECT_EQ(e.copies[3].neighbour, 0);
  EXPECT_EQ(e.copies[3].place, MessagePlace(1));
}

/// The order of slots is each rank's own affair; what is exchanged is not.
TEST(Interface, DoesNotDependOnTheOrderOfSlots) {
  const Decomposed d = decompose(8, 12, PartitionKind::rcb);
  std::vector<std::int32_t> order(d.bodies.size());  // new slot k holds old order[k]
  std::iota(order.begin(), order.end(), 0);
  test::Random random(3);
  std::shuffle(order.begin(), order.end(), random);
  std::vector<BodyIncidence> list;
  std::vector<BodyId> id;
  for (std::size_t k = 0; k < order.size(); ++k) {
    id.push_back(d.bodies.id[at(order[k])]);
    for (const SubdomainId in : d.grains.of(at(order[k]))) list.push_back({static_cast<Slot>(k), in});
  }
  const auto a = build_interfaces(d.grains, d.bodies.id, up_to(12));
  const auto b = build_interfaces(collect_incidences(order.size(), list), id, up_to(12));
  for (std::size_t e = 0; e < 12; ++e) {
    ASSERT_EQ(a[e].exchange.size(), b[e].exchange.size());
    for (std::size_t k = 0; k < a[e].exchange.size(); ++k)
      EXPECT_EQ(d.bodies.id[at(a[e].bodies[at(a[e].exchange[k])])],
                id[at(b[e].bodies[at(b[e].exchange[k])])]);
    ASSERT_EQ(a[e].copies.size(), b[e].copies.size());
    for (std::size_t k = 0; k < a[e].copies.size(); ++k) {
      EXPECT_EQ(a[e].copies[k].neighbour, b[e].copies[k].neighbour);
      if (a[e].copies[k].neighbour >= 0) {
        EXPECT_EQ(a[e].copies[k].place, b[e].copies[k].place);
      }
    }
  }
}

TEST(Interface, AGrainInManySubdomainsIsAHubAndInNoExchangeList) {
  std::vector<BodyIncidence> list;
  for (std::int32_t e = 0; e < 20; ++e) list.push_back({0, SubdomainId(e)});
  list.push_back({1, SubdomainId(3)});
  list.push_back({1, SubdomainId(4)});
  const std::vector<BodyId> id{BodyId{0}, BodyId{1}};
  const auto interfaces = build_interfaces(collect_incidences(2, list), id, up_to(20));
  std::size_t ties = 0;
  for (const SubdomainInterface& e : interfaces) {
    ASSERT_EQ(e.hubs.size(), 1u);
    EXPECT_EQ(e.bodies[at(e.shared[at(e.hubs[0])])], 0);
    EXPECT_EQ(e.owner[at(e.hubs[0])], SubdomainId(0));
    ties += e.exchange.size();
  }
  EXPECT_EQ(ties, 2u);
}

TEST(LoadTable, CountsWhatBruteForceCountsOnAnyNumberOfRanks) {
  const Decomposed d = decompose(9, 12, PartitionKind::rcb);
  const auto sets = standings_by_brute_force(d);
  const std::span contacts(d.subdomain);
  const auto here = up_to(12);
  const LoadTable whole =
      measure_load(12, build_interfaces(d.grains, d.bodies.id, here), d.grains, d.of_walls, contacts);
  for (std::int32_t e = 0; e < 12; ++e) {
    std::int64_t bodies = 0, shared = 0, corner = 0;
    std::set<SubdomainId> others;
    for (const auto& set : sets) {
      if (set.count(SubdomainId(e)) == 0) continue;
      ++bodies;
      shared += set.size() > 1;
      corner += set.size() > 2;
      others.insert(set.begin(), set.end());
    }
    EXPECT_EQ(whole.bodies[at(e)], bodies);
    EXPECT_EQ(whole.shared_bodies[at(e)], shared);
    EXPECT_EQ(whole.corner_bodies[at(e)], corner);
    EXPECT_EQ(whole.neighbours[at(e)], static_cast<std::int64_t>(others.size()) - 1);
    EXPECT_GE(whole.wall_neighbours[at(e)], whole.neighbours[at(e)]);
    EXPECT_EQ(whole.contacts[at(e)], std::count(d.subdomain.begin(), d.subdomain.end(), SubdomainId(e)));
  }
  std::vector<LoadTable> parts(3);
  graph::on_pretend_ranks(3, [&](const graph::Communicator& ranks) {
    const auto rank = static_cast<std::size_t>(ranks.rank());
    const auto interfaces = build_interfaces(d.grains, d.bodies.id, std::span(here).subspan(4 * rank, 4));
    const std::size_t begin = contacts.size() * rank / 3, end = contacts.size() * (rank + 1) / 3;
    parts[rank] = measure_load(12, interfaces, d.grains, d.of_walls, contacts.subspan(begin, end - begin),
                               reduction_over(ranks));
  });
  for (const LoadTable& part : parts) {
    EXPECT_EQ(part.contacts, whole.contacts);
    EXPECT_EQ(part.corner_bodies, whole.corner_bodies);
    EXPECT_EQ(part.wall_neighbours, whole.wall_neighbours);
  }
}

TEST(LoadTable, VariationIsThePapers) {
  const Spread spread = spread_of(std::vector<std::int64_t>{2086, 2633, 2355});
  EXPECT_EQ(spread.min, 2086);
  EXPECT_EQ(spread.max, 2633);
  EXPECT_NEAR(spread.variation, 0.232, 5e-4);
  EXPECT_EQ(spread_of({}).variation, 0);
  EXPECT_EQ(spread_of(std::vector<std::int64_t>{0, 0}).variation, 0);
}

}  // namespace
}  // namespace talus
