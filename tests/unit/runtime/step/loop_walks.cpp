/// The loops of all ranks, as the program plans them, played to their end on made-up subdomains: nobody waits
/// for ever.

#include "runtime/graph/loop_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <numeric>
#include <utility>
#include <vector>

#include "partition/subdomain_colours.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::graph::loop_walks_test {
namespace {

using test::Random;
using test::uniform;

/// n_x x n_y x n_z boxes with made-up numbers of chunks, each on one rank.
struct Machine {
  std::vector<std::vector<std::size_t>> neighbours;
  std::vector<char> subdomain_colour;
  std::vector<std::size_t> rank_of;
  std::vector<int> border, inside;  ///< chunks per subdomain
  std::size_t ranks = 0;
  int threads = 1;
  bool overlap = true;
};

/// A node of the plan that waits or is waited for. Work does neither.
struct Node {
  LoopRole role;
  std::size_t subdomain;  ///< of collect and root none
};

/// What a thread goes through, in order.
struct Walk {
  std::size_t rank;
  std::vector<Node> nodes;
};

class Play {
 public:
  explicit Play(const Machine& machine) : machine_(machine), tells_left_(machine.ranks, 0) {
    std::vector<RankLoad> load(machine.ranks);
    for (std::size_t e = 0; e < machine.subdomain_colour.size(); ++e) {
      RankLoad& rank = load[machine.rank_of[e]];
      rank.work += static_cast<std::uint64_t>(10 + machine.border[e] + machine.inside[e]);
      rank.waits = rank.waits || machine.subdomain_colour[e] > 0;
      ++tells_left_[machine.rank_of[e]];
    }
    tree_ = grow_tree(load);
    for (std::size_t r = 0; r < machine.ranks; ++r) add_walks(r);
    published_.assign(machine.subdomain_colour.size(), 0);
    up_.assign(machine.ranks, 0);
    down_.assign(machine.ranks, 0);
  }

  bool has_relays() const {
    return std::ranges::any_of(tree_.order, [&](int rank) { return tree_.relays(rank); });
  }

  /// True when all walks come to their ends.
  bool ends() {
    std::vector<std::size_t> at(walks_.size(), 0);
    for (bool moved = true; moved;) {
      moved = false;
      for (std::size_t w = 0; w < walks_.size(); ++w)
        for (; at[w] < walks_[w].nodes.size() && may_run(walks_[w], walks_[w].nodes[at[w]]); ++at[w]) {
          run(walks_[w].rank, walks_[w].nodes[at[w]]);
          moved = true;
        }
    }
    for (std::size_t w = 0; w < walks_.size(); ++w)
      if (at[w] < walks_[w].nodes.size()) return false;
    return true;
  }

 private:
  LoopSpec spec_of(std::size_t rank, const std::vector<std::size_t>& mine) const {
    LoopSpec spec;
    using enum LoopWork::Side;
    for (std::uint32_t k = 0; k < mine.size(); ++k) {
      const char colour = machine_.subdomain_colour[mine[k]];
      LoopGroup group{.colour = colour, .tells = true, .readers = {}};
      for (const std::size_t other : machine_.neighbours[mine[k]])
        if (const auto at = std::ranges::find(mine, other); at != mine.end())
          group.readers.push_back(static_cast<std::uint32_t>(at - mine.begin()));
      spec.groups.push_back(group);
      std::uint32_t next = 0;
      const auto add = [&](LoopWork::Side side, int count) {
        for (int i = 0; i < count; ++i, ++next) spec.work.push_back({side, k, next, 1, next});
      };
      add(early, 2);
      if (colour == 0) add(border, machine_.border[mine[k]]);
      add(inside, machine_.inside[mine[k]]);
      if (colour > 0) add(late, machine_.border[mine[k]]);
    }
    spec.offset.assign(spec.work.size() + 1, 0);
    spec.in_colours = std::ranges::any_of(machine_.subdomain_colour, [](char colour) { return colour > 0; });
    spec.overlap = machine_.overlap;
    spec.collects = tree_.relays(static_cast<int>(rank));
    spec.threads = machine_.threads;
    spec.rank = static_cast<int>(rank);
    return spec;
  }

  void add_walks(std::size_t rank) {
    std::vector<std::size_t> mine;
    for (std::size_t e = 0; e < machine_.subdomain_colour.size(); ++e)
      if (machine_.rank_of[e] == rank) mine.push_back(e);
    const LoopPlan plan = plan_loop(spec_of(rank, mine), tree_);
    std::vector<std::uint32_t> order(plan.nodes.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t n) { return plan.colour[n]; });
    std::vector<Walk> walks(static_cast<std::size_t>(machine_.threads), Walk{rank, {}});
    for (const std::uint32_t n : order) {
      const auto [role, group] = plan.nodes[n];
      if (role == LoopRole::work) continue;
      walks[plan.owner[n]].nodes.push_back({role, group == LoopPlan::none ? 0 : mine[group]});
    }
    for (Walk& walk : walks) walks_.push_back(std::move(walk));
  }

  bool may_run(const Walk& walk, const Node& node) const {
    const auto all_of = [&](auto wanted) {
      return std::ranges::all_of(machine_.neighbours[node.subdomain],
                                 [&](std::size_t other) { return !wanted(other) || published_[other] != 0; });
    };
    const bool top = static_cast<int>(walk.rank) == tree_.top();
    switch (node.role) {
      case LoopRole::take:
        return all_of([&](std::size_t e) {
          return machine_.subdomain_colour[e] < machine_.subdomain_colour[node.subdomain];
        });
      case LoopRole::glue:
        return down_[walk.rank] != 0 && all_of([](std::size_t) { return true; });
      case LoopRole::root:
        if (!top)
          return tells_left_[walk.rank] == 0 && down_[static_cast<std::size_t>(tree_.parent[walk.rank])] != 0;
        [[fallthrough]];
      case LoopRole::collect:
        return tells_left_[walk.rank] == 0 && std::ranges::all_of(tree_.children[walk.rank], [&](int child) {
                 return up_[static_cast<std::size_t>(child)] != 0;
               });
      case LoopRole::work:
      case LoopRole::publish:
      case LoopRole::tell:
        break;
    }
    return true;
  }

  void run(std::size_t rank, const Node& node) {
    if (node.role == LoopRole::publish) published_[node.subdomain] = 1;
    if (node.role == LoopRole::collect) up_[rank] = 1;
    if (node.role == LoopRole::root) down_[rank] = 1;
    if (node.role == LoopRole::tell && --tells_left_[rank] == 0 && tree_.leaf(static_cast<int>(rank)))
      up_[rank] = 1;
  }

  const Machine& machine_;
  Tree tree_;
  std::vector<Walk> walks_;
  std::vector<char> published_, up_,
      down_;  ///< per subdomain; per rank: its part has left; it has the answer
  std::vector<int> tells_left_;
};

/// With subdomain colours as the partition chooses them, or none.
Machine made_up(Random& random, bool in_colours) {
  const auto any = [&](int from, int to) {
    return std::min(to, from + static_cast<int>(uniform(random, 0, to - from + 1)));
  };
  const std::array<int, 3> boxes = {any(2, 6), any(2, 6), any(1, 4)};
  const auto count = static_cast<std::size_t>(boxes[0] * boxes[1] * boxes[2]);
  Machine machine;
  machine.neighbours.resize(count);
  std::vector<Tie> ties;
  const auto place = [&](std::size_t e) {
    const int n = static_cast<int>(e);
    return std::array{n % boxes[0], n / boxes[0] % boxes[1], n / boxes[0] / boxes[1]};
  };
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b) {
      int apart = 0, farthest = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const int d = std::abs(place(a)[k] - place(b)[k]);
        apart += d;
        farthest = std::max(farthest, d);
      }
      if (farthest != 1) continue;
      machine.neighbours[a].push_back(b);
      ties.push_back({SubdomainId(a), SubdomainId(b), apart == 1 ? 100 : apart == 2 ? 10 : 1});
    }
  machine.subdomain_colour = in_colours ? choose_subdomain_colours(static_cast<std::int32_t>(count), ties)
                                        : std::vector<char>(count, 0);
  machine.ranks = std::max<std::size_t>(1, count / static_cast<std::size_t>(any(1, 8)));
  const bool cyclic = any(0, 1) == 1;
  for (std::size_t e = 0; e < count; ++e) {
    machine.rank_of.push_back(cyclic ? e % machine.ranks : e * machine.ranks / count);
    machine.border.push_back(any(1, 14));
    machine.inside.push_back(any(0, 14));
  }
  machine.threads = any(1, 3);
  machine.overlap = any(0, 3) > 0;
  return machine;
}

TEST(LoopWalks, OfAnyRanksThreadsAndTurnsComeToTheirEnds) {
  Random random(1);
  int with_relays = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Machine machine = made_up(random, trial % 4 != 0);
    Play play(machine);
    with_relays += play.has_relays() ? 1 : 0;
    ASSERT_TRUE(play.ends()) << "trial " << trial << ": " << machine.subdomain_colour.size()
                             << " subdomains, " << machine.ranks << " ranks, " << machine.threads
                             << " threads, overlap " << machine.overlap;
  }
  EXPECT_GT(with_relays, 100);
}

}  // namespace
}  // namespace talus::graph::loop_walks_test
