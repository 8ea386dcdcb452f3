#include "runtime/trace/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "runtime/graph/epoch_graph.hpp"
#include "runtime/graph/loop_plan.hpp"
#include "runtime/graph/tree.hpp"

namespace talus::trace {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

std::uint32_t scaled_bytes(std::uint32_t bytes, double factor) {
  return static_cast<std::uint32_t>(std::min(4e9, std::round(factor * bytes)));
}

/// The plan of each rank of `out` as the program would have made it, without its messages.
void describe_plans(const std::vector<const Plan*>& plans, int threads, LoopLayout& out) {
  out.plans.resize(out.rank_begin.size() - 1);
  for (std::size_t r = 0; r < out.plans.size(); ++r) {
    Plan& plan = out.plans[r];
    plan.rank = static_cast<std::int32_t>(r);
    plan.offset.push_back(0);
    for (std::uint32_t n = out.rank_begin[r]; n < out.rank_begin[r + 1]; ++n) {
      const SimNode& node = out.nodes[n];
      plan.colour.push_back(node.colour);
      plan.group.push_back(node.group);
      plan.role.push_back(static_cast<std::uint8_t>(node.role));
      const Plan* source =
          node.source_rank >= 0 ? plans[static_cast<std::size_t>(node.source_rank)] : nullptr;
      plan.weight.push_back(source ? source->weight[node.source_node] : 0);
      plan.place.push_back(source ? source->place[node.source_node] : 0);
      plan.owner.push_back(node.worker % static_cast<std::uint32_t>(threads));
      for (std::uint32_t other : out.neighbours(n)) plan.neighbour.push_back(other - out.rank_begin[r]);
      plan.offset.push_back(static_cast<std::uint32_t>(plan.neighbour.size()));
    }
  }
}

/// Builds a LoopLayout; the steps of build() say what comes after what.
class Builder {
 public:
  Builder(const std::vector<const Plan*>& plans, const std::vector<std::uint32_t>& groups,
          const std::vector<std::uint32_t>& rank_of, const Machine& machine)
      : plans_(plans), groups_(groups), rank_of_(rank_of), machine_(machine), faces_(machine.faces()) {}

  LoopLayout build() {
    out_.offset.push_back(0);
    find_group_nodes();
    find_readers();
    grow_tree();
    for (std::uint32_t r = 0; r < static_cast<std::uint32_t>(machine_.ranks); ++r) add_rank(r);
    out_.rank_begin.push_back(static_cast<std::uint32_t>(out_.nodes.size()));
    route_messages();
    sort_walks();
    describe_plans(plans_, machine_.threads, out_);
    add_messages();
    return std::move(out_);
  }

 private:
  /// Per role of a node; none where a group has no such node.
  class GroupNodes {
   public:
    GroupNodes() { node_.fill(none); }
    std::uint32_t& operator[](Role role) { return node_[static_cast<std::size_t>(role)]; }
    std::uint32_t operator[](Role role) const { return node_[static_cast<std::size_t>(role)]; }

   private:
    std::array<std::uint32_t, static_cast<std::size_t>(Role::tell) + 1> node_;
  };
  struct Group {
    std::int32_t source = -1;           ///< recorded rank
    std::vector<std::uint32_t> chunks;  ///< recorded nodes
    std::vector<std::size_t> readers;   ///< groups, as places in groups_, that read what it publishes
    GroupNodes recorded, made;          ///< nodes that are no work
    bool publish_tells() const { return subdomain_colour == 0 && recorded[Role::tell] == none; }
    std::uint32_t teller() const { return made[publish_tells() ? Role::publish : Role::tell]; }
    std::uint32_t subdomain_colour = 0;
  };

  /// The node that takes a message.
  static std::uint32_t receiver(const Group& from, const Group& to) {
    return from.subdomain_colour < to.subdomain_colour ? to.made[Role::take] : to.made[Role::glue];
  }

  std::size_t place_of(std::uint32_t group) const {
    const auto at = std::lower_bound(groups_.begin(), groups_.end(), group);
    if (at == groups_.end() || *at != group)
      throw TraceError(fmt::format("no plan has a subdomain {}", group));
    return static_cast<std::size_t>(at - groups_.begin());
  }

  void grow_tree() {
    std::vector<graph::RankLoad> load(static_cast<std::size_t>(machine_.ranks));
    for (const Plan* plan : plans_) {
      for (const Message& message : plan->messages) has_centre_ = has_centre_ || message.to == root_group;
      add_load(
          *plan, [&](std::uint32_t group) { return rank_of_[place_of(group)]; }, load);
    }
    out_.tree = graph::grow_tree(load);
    load.assign(plans_.size(), {});
    for (std::size_t s = 0; s < plans_.size(); ++s)
      add_load(
          *plans_[s], [&](std::uint32_t) { return s; }, load);
    recorded_top_ = static_cast<std::size_t>(graph::grow_tree(load).top());
  }

  void find_group_nodes() {
    group_.resize(groups_.size());
    for (std::size_t s = 0; s < plans_.size(); ++s) {
      const Plan& plan = *plans_[s];
      for (std::uint32_t n = 0; n < plan.size(); ++n) {
        const Role role = static_cast<Role>(plan.role[n]);
        if (role == Role::root) continue;
        Group& group = group_[place_of(plan.group[n])];
        if (group.source >= 0 && group.source != static_cast<std::int32_t>(s))
          throw TraceError(fmt::format("subdomain {} is on two ranks at once", plan.group[n]));
        group.source = static_cast<std::int32_t>(s);
        if (role == Role::compute) group.chunks.push_back(n);
        if (role != Role::compute) group.recorded[role] = n;
        if (role == Role::take) {
          group.subdomain_colour = plan.place[n];
          in_colours_ = in_colours_ || group.subdomain_colour > 0;
        }
      }
    }
    for (const Group& group : group_) {
      const std::uint32_t glue = group.recorded[Role::glue];
      if (glue == none || group.subdomain_colour > 0) continue;
      const Plan& plan = *plans_[static_cast<std::size_t>(group.source)];
      for (const std::uint32_t n : group.chunks)
        if (plan.colour[glue] < plan.colour[n]) overlap_ = false;
    }
  }

  /// By what it conflicts with: work inside has nothing to do with the exchange of its group.
  graph::LoopWork::Side side_of(const Group& group, std::uint32_t recorded) const {
    const Plan& plan = *plans_[static_cast<std::size_t>(group.source)];
    using enum graph::LoopWork::Side;
    const auto joined = [&](std::uint32_t node) {
      const auto others = plan.neighbours(recorded);
      return node != none && std::find(others.begin(), others.end(), node) != others.end();
    };
    if (joined(group.recorded[Role::tell])) return early;
    if (!joined(group.recorded[Role::publish])) return inside;
    return group.subdomain_colour > 0 ? late : border;
  }

  /// What the program would plan the loop of a rank from, with these groups (places in groups_) on it.
  /// `recorded`: of each node of work, its place in groups_ and its recorded node.
  graph::LoopSpec spec_of(std::uint32_t rank, const std::vector<std::size_t>& mine,
                          std::vector<std::pair<std::size_t, std::uint32_t>>& recorded) const {
    graph::LoopSpec spec;
    spec.in_colours = in_colours_;
    spec.overlap = overlap_;
    spec.collects = has_centre_ && out_.tree.relays(static_cast<int>(rank));
    spec.threads = machine_.threads;
    spec.rank = static_cast<int>(rank);
    for (const std::size_t g : mine) {
      const Group& group = group_[g];
      const auto here = static_cast<std::uint32_t>(spec.groups.size());
      spec.groups.push_back({.colour = static_cast<char>(group.subdomain_colour),
                             .exchanges = group.recorded[Role::publish] != none,
                             .tells = group.recorded[Role::tell] != none,
                             .readers = {}});
      for (const std::size_t reader : group.readers)
        if (const auto at = std::lower_bound(mine.begin(), mine.end(), reader);
            at != mine.end() && *at == reader)
          spec.groups.back().readers.push_back(static_cast<std::uint32_t>(at - mine.begin()));
      for (const std::uint32_t n : group.chunks) {
        const Plan& plan = *plans_[static_cast<std::size_t>(group.source)];
        spec.work.push_back({side_of(group, n), here, plan.colour[n], plan.weight[n], plan.place[n]});
        recorded.emplace_back(g, n);
      }
    }
    keep_conflicts(recorded, spec);
    return spec;
  }

  void find_readers() {
    for (const Plan* plan : plans_)
      for (const Message& m : plan->messages) {
        if (m.from == root_group || m.to == root_group) continue;
        const std::size_t from = place_of(m.from), to = place_of(m.to);
        if (group_[from].recorded[Role::publish] == none || group_[to].recorded[Role::glue] == none)
          throw TraceError("a message between subdomains without gluing");
        group_[from].readers.push_back(to);
      }
  }

  /// Those of the recorded work that comes to one rank.
  void keep_conflicts(const std::vector<std::pair<std::size_t, std::uint32_t>>& recorded,
                      graph::LoopSpec& spec) const {
    std::map<std::pair<std::int32_t, std::uint32_t>, std::uint32_t> work;  // recorded rank and node -> node
    for (std::uint32_t n = 0; n < recorded.size(); ++n)
      work[{group_[recorded[n].first].source, recorded[n].second}] = n;
    spec.offset.push_back(0);
    for (const auto& [g, n] : recorded) {
      const std::int32_t source = group_[g].source;
      for (const std::uint32_t other : plans_[static_cast<std::size_t>(source)]->neighbours(n))
        if (const auto found = work.find({source, other}); found != work.end())
          spec.neighbour.push_back(found->second);
      spec.offset.push_back(static_cast<std::uint32_t>(spec.neighbour.size()));
    }
  }

  /// Nodes of a rank as the program would have them.
  void add_rank(std::uint32_t rank) {
    const auto first = static_cast<std::uint32_t>(out_.nodes.size());
    out_.rank_begin.push_back(first);
    out_.tellers.push_back(0);
    root_.push_back(none);
    collect_.push_back(none);
    std::vector<std::size_t> mine;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (rank_of_[g] == rank) mine.push_back(g);
    std::vector<std::pair<std::size_t, std::uint32_t>> recorded;
    const graph::LoopSpec spec = spec_of(rank, mine, recorded);
    const graph::LoopPlan plan = graph::plan_loop(spec, out_.tree);
    for (std::uint32_t n = 0; n < plan.nodes.size(); ++n) {
      const auto [role, here] = plan.nodes[n];
      if (here == graph::LoopPlan::none) {
        (role == graph::LoopRole::root ? root_ : collect_).back() = first + n;
        out_.nodes.push_back(root_node(rank, plan.colour[n]));
      } else {
        Group& group = group_[mine[here]];
        const std::uint32_t source =
            role == graph::LoopRole::work ? recorded[n].second : group.recorded[role_of(role)];
        out_.nodes.push_back(
            {group.source, source, role_of(role), groups_[mine[here]], rank, 0, plan.colour[n]});
        if (role != graph::LoopRole::work) group.made[role_of(role)] = first + n;
      }
      out_.nodes.back().worker = rank * static_cast<std::uint32_t>(machine_.threads) + plan.owner[n];
    }
    for (const std::size_t g : mine) {
      const std::uint32_t teller = group_[g].teller();
      if (teller == none) continue;
      out_.nodes[teller].tells = true;
      ++out_.tellers.back();
    }
    for (std::size_t n = 0; n < plan.nodes.size(); ++n) {
      for (std::size_t k = plan.offset[n]; k < plan.offset[n + 1]; ++k)
        out_.neighbour.push_back(first + plan.neighbour[k]);
      out_.offset.push_back(static_cast<std::uint32_t>(out_.neighbour.size()));
    }
  }

  /// The top is the root; the others hand on what goes up and down, and work no more than that.
  SimNode root_node(std::uint32_t rank, std::uint32_t colour) const {
    const bool top = static_cast<int>(rank) == out_.tree.top();
    const std::size_t recorded = top || plans_.size() == 1 ? recorded_top_ : recorded_top_ == 0 ? 1 : 0;
    SimNode node{-1, 0, Role::root, root_group, rank, 0, colour};
    node.waits_only = !top && recorded == recorded_top_;
    const Plan& plan = *plans_[recorded];
    for (std::uint32_t n = 0; n < plan.size(); ++n)
      if (static_cast<Role>(plan.role[n]) == Role::root) {
        node.source_rank = static_cast<std::int32_t>(recorded);
        node.source_node = n;
      }
    return node;
  }

  /// Two threads of the machine, of which one thread did the work when it was recorded: what it took to hand
  /// the data over is not in the recorded times.
  static bool newly_shared(const Plan& plan, const SimNode& from, const SimNode& to) {
    return from.worker != to.worker && from.source_rank == to.source_rank &&
           plan.owner[from.source_node] == plan.owner[to.source_node];
  }

  void route_messages() {
    out_.incoming.assign(out_.nodes.size(), 0);
    out_.handed.assign(out_.nodes.size(), 0);
    std::vector<std::vector<SimMessage>> sends(out_.nodes.size());
    const auto ranks = static_cast<std::size_t>(machine_.ranks);
    std::vector<std::uint64_t> up(ranks, 0), down(ranks, 0);
    for (const Plan* plan : plans_)
      for (const Message& m : plan->messages) {
        const std::uint32_t bytes = scaled_bytes(m.bytes, faces_);
        if (m.to == root_group) {
          up[rank_of_[place_of(m.from)]] += bytes;
        } else if (m.from == root_group) {
          down[rank_of_[place_of(m.to)]] += bytes;
        } else {
          const Group &sender = group_[place_of(m.from)], &taker = group_[place_of(m.to)];
          const std::uint32_t from = sender.made[Role::publish], to = receiver(sender, taker);
          if (out_.nodes[from].rank == out_.nodes[to].rank) {
            if (!newly_shared(*plan, out_.nodes[from], out_.nodes[to])) continue;
            out_.handed[from] += bytes;
            out_.handed[to] += bytes;
            continue;
          }
          sends[from].push_back({from, to, bytes, message_name(m.from, m.to)});
          ++out_.incoming[to];
        }
      }
    out_.to_root.resize(ranks);
    // A message of the tree holds those of the whole branch.
    for (std::size_t k = ranks; k-- > 1;) {
      const auto r = static_cast<std::size_t>(out_.tree.order[k]),
                 parent = static_cast<std::size_t>(out_.tree.parent[r]);
      up[parent] += up[r];
      down[parent] += down[r];
      if (up[r] == 0 || root_[r] == none || root_[parent] == none) continue;
      const auto first =
          static_cast<std::uint32_t>(std::find(rank_of_.begin(), rank_of_.end(), r) - rank_of_.begin());
      const auto named = [](std::uint64_t bytes) {
        return static_cast<std::uint32_t>(std::min<std::uint64_t>(bytes, none));
      };
      const SimMessage message{collect_[r] == none ? root_[r] : collect_[r],
                               collect_[parent] == none ? root_[parent] : collect_[parent], named(up[r]),
                               message_name(groups_[first], root_group)};
      if (collect_[r] == none)
        out_.to_root[r] = message;
      else
        sends[collect_[r]].push_back(message);
      ++out_.incoming[message.to];
      sends[root_[parent]].push_back(
          {root_[parent], root_[r], named(down[r]), message_name(root_group, groups_[first])});
      ++out_.incoming[root_[r]];
    }
    for (const auto& of_node : sends) {
      out_.send_begin.push_back(static_cast<std::uint32_t>(out_.sends.size()));
      out_.sends.insert(out_.sends.end(), of_node.begin(), of_node.end());
    }
    out_.send_begin.push_back(static_cast<std::uint32_t>(out_.sends.size()));
  }

  void sort_walks() {
    out_.walk.resize(out_.nodes.size());
    std::iota(out_.walk.begin(), out_.walk.end(), 0U);
    std::stable_sort(out_.walk.begin(), out_.walk.end(), [&](std::uint32_t a, std::uint32_t b) {
      const SimNode &x = out_.nodes[a], &y = out_.nodes[b];
      return x.worker != y.worker ? x.worker < y.worker : x.colour < y.colour;
    });
    out_.walk_begin.assign(
        static_cast<std::size_t>(machine_.ranks) * static_cast<std::size_t>(machine_.threads) + 1, 0);
    for (const SimNode& node : out_.nodes) ++out_.walk_begin[node.worker + 1];
    std::partial_sum(out_.walk_begin.begin(), out_.walk_begin.end(), out_.walk_begin.begin());
  }

  /// Those of the recording, at the rank that has their subdomain.
  void add_messages() {
    for (const Plan* plan : plans_)
      for (const Message& m : plan->messages) {
        const std::uint16_t group = m.from == root_group ? m.to : m.from;
        out_.plans[rank_of_[place_of(group)]].messages.push_back(
            {m.from, m.to, scaled_bytes(m.bytes, faces_)});
      }
  }

  const std::vector<const Plan*>& plans_;
  const std::vector<std::uint32_t>& groups_;
  const std::vector<std::uint32_t>& rank_of_;
  const Machine& machine_;
  const double faces_;
  std::vector<Group> group_;            ///< like groups_
  bool in_colours_ = false;             ///< some group has a later subdomain colour than the first
  bool overlap_ = true;                 ///< glue comes behind the chunks inside
  bool has_centre_ = false;             ///< something goes through it
  std::size_t recorded_top_ = 0;        ///< the rank that was the root
  std::vector<std::uint32_t> root_;     ///< per rank
  std::vector<std::uint32_t> collect_;  ///< per rank; none unless it is between the top and the leaves
  LoopLayout out_;
};

}  // namespace

LoopLayout lay_out(const std::vector<const Plan*>& plans, const std::vector<std::uint32_t>& groups,
                   const std::vector<std::uint32_t>& rank_of, const Machine& machine) {
  return Builder(plans, groups, rank_of, machine).build();
}

}  // namespace talus::trace
