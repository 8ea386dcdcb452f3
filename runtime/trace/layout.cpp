#include "runtime/trace/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "runtime/graph/epoch_graph.hpp"
#include "runtime/graph/loop_colours.hpp"
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
    find_group_nodes();
    grow_tree();
    for (std::uint32_t r = 0; r < static_cast<std::uint32_t>(machine_.ranks); ++r) add_rank(r);
    out_.rank_begin.push_back(static_cast<std::uint32_t>(out_.nodes.size()));
    connect();
    route_messages();
    sort_walks();
    describe_plans(plans_, machine_.threads, out_);
    add_messages();
    return std::move(out_);
  }

 private:
  struct Group {
    std::int32_t source = -1;           ///< recorded rank
    std::vector<std::uint32_t> chunks;  ///< recorded nodes
    std::uint32_t publish = none, glue = none, take = none, tell = none;
    std::uint32_t new_publish = none, new_glue = none, new_take = none, new_tell = none;
    bool publish_tells() const { return subdomain_colour == 0 && tell == none; }
    std::uint32_t teller() const { return publish_tells() ? new_publish : new_tell; }
    std::uint32_t subdomain_colour = 0;
  };

  /// The node that takes a message.
  static std::uint32_t receiver(const Group& from, const Group& to) {
    return from.subdomain_colour < to.subdomain_colour ? to.new_take : to.new_glue;
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
        if (role == Role::publish) group.publish = n;
        if (role == Role::glue) group.glue = n;
        if (role == Role::take) {
          group.take = n;
          group.subdomain_colour = plan.place[n];
          in_colours_ = in_colours_ || group.subdomain_colour > 0;
        }
        if (role == Role::tell) group.tell = n;
      }
    }
    for (const Group& group : group_)
      for (std::uint32_t n : group.chunks)
        if (const Plan& plan = *plans_[static_cast<std::size_t>(group.source)];
            group.glue != none && group.subdomain_colour == 0 && plan.colour[group.glue] < plan.colour[n])
          overlap_ = false;
  }

  graph::ChunkOrder::Side side_of(const Group& group, const SimNode& node) const {
    const Plan& plan = *plans_[static_cast<std::size_t>(group.source)];
    using enum graph::ChunkOrder::Side;
    if (group.tell != none && node.colour < plan.colour[group.tell]) return early;
    if (group.subdomain_colour > 0) return plan.colour[group.take] < node.colour ? late : inside;
    return group.publish == none || plan.colour[group.publish] < node.colour ? inside : border;
  }

  std::uint32_t add_node(std::uint32_t rank, std::int32_t source, std::uint32_t n) {
    const Plan& plan = *plans_[static_cast<std::size_t>(source)];
    out_.nodes.push_back(
        {source, n, static_cast<Role>(plan.role[n]), plan.group[n], rank, 0, plan.colour[n]});
    return static_cast<std::uint32_t>(out_.nodes.size() - 1);
  }

  /// As the program would have them with these subdomains on one rank; `first`: the rank's first chunk, all
  /// of which get theirs.
  graph::LoopColours colours_of(std::uint32_t first, std::span<const std::size_t> mine) {
    std::vector<graph::ChunkOrder> subdomain_colours;
    std::vector<char> subdomain_colour_of, tells;
    for (std::size_t g : mine) {
      subdomain_colour_of.push_back(static_cast<char>(group_[g].subdomain_colour));
      tells.push_back(group_[g].tell != none ? 1 : 0);
    }
    for (std::size_t n = first, at = 0; n < out_.nodes.size(); ++n) {
      const SimNode& node = out_.nodes[n];
      while (groups_[mine[at]] != node.group) ++at;
      subdomain_colours.push_back(
          {side_of(group_[mine[at]], node), static_cast<std::uint32_t>(at), node.colour});
    }
    graph::LoopColours colours =
        graph::loop_colours(subdomain_colours, subdomain_colour_of, tells, in_colours_, overlap_,
                            machine_.threads, static_cast<int>(out_.rank_begin.size()) - 1, out_.tree);
    for (std::size_t k = 0; k < subdomain_colours.size(); ++k)
      out_.nodes[first + k].colour = colours.chunk[k];
    return colours;
  }

  /// Nodes of a rank in the program's order: chunks, publishes, the root, glues, takes, tells; and their
  /// owners.
  void add_rank(std::uint32_t rank) {
    const auto first = static_cast<std::uint32_t>(out_.nodes.size());
    out_.rank_begin.push_back(first);
    std::vector<std::size_t> mine;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (rank_of_[g] == rank) mine.push_back(g);
    struct Chunk {
      std::size_t group;
      std::uint32_t place, weight, node;
    };
    std::vector<Chunk> chunks;
    for (std::size_t g : mine)
      for (std::uint32_t n : group_[g].chunks) {
        const Plan& plan = *plans_[static_cast<std::size_t>(group_[g].source)];
        chunks.push_back({g, plan.place[n], plan.weight[n], add_node(rank, group_[g].source, n)});
      }
    std::stable_sort(chunks.begin(), chunks.end(), [](const Chunk& a, const Chunk& b) {
      return a.group != b.group ? a.group < b.group : a.place < b.place;
    });
    std::vector<std::uint32_t> weight, group_of, owner(chunks.size());
    for (const Chunk& chunk : chunks) {
      weight.push_back(chunk.weight);
      group_of.push_back(static_cast<std::uint32_t>(chunk.group));
    }
    graph::assign_owners(weight, group_of, machine_.threads, owner);
    const auto worker = [&](std::uint32_t thread) {
      return rank * static_cast<std::uint32_t>(machine_.threads) + thread;
    };
    std::map<std::size_t, std::uint32_t> first_owner;
    for (std::size_t k = 0; k < chunks.size(); ++k) {
      out_.nodes[chunks[k].node].worker = worker(owner[k]);
      first_owner.try_emplace(chunks[k].group, owner[k]);
    }
    const auto owner_of = [&](std::size_t g) {
      const auto found = first_owner.find(g);
      return worker(found == first_owner.end() ? 0 : found->second);
    };
    const graph::LoopColours colours = colours_of(first, mine);
    std::uint32_t tellers = 0;
    bool glued = false;
    for (std::size_t at = 0; at < mine.size(); ++at) {
      const std::size_t g = mine[at];
      if (group_[g].publish == none) continue;
      group_[g].new_publish = add_node(rank, group_[g].source, group_[g].publish);
      out_.nodes.back().worker = owner_of(g);
      out_.nodes.back().colour = colours.publish[at];
      out_.nodes.back().tells = group_[g].publish_tells();
      tellers += group_[g].publish_tells() || group_[g].tell != none ? 1 : 0;
      glued = true;
    }
    out_.tellers.push_back(tellers);
    root_.push_back(none);
    collect_.push_back(none);
    if (!glued) return;
    const auto add = [&](std::uint32_t colour) {
      out_.nodes.push_back(root_node(rank, colour));
      out_.nodes.back().worker = worker(0);
      return static_cast<std::uint32_t>(out_.nodes.size() - 1);
    };
    if (has_centre_ && out_.tree.relays(static_cast<int>(rank))) collect_.back() = add(colours.tree.up);
    root_.back() = add(colours.tree.down);
    for (std::size_t g : mine) {
      if (group_[g].glue == none) continue;
      group_[g].new_glue = add_node(rank, group_[g].source, group_[g].glue);
      out_.nodes.back().worker = owner_of(g);
      out_.nodes.back().colour = colours.glue;
    }
    for (std::size_t at = 0; at < mine.size(); ++at) {
      Group& group = group_[mine[at]];
      if (group.subdomain_colour == 0) continue;
      group.new_take = add_node(rank, group.source, group.take);
      out_.nodes.back().worker = owner_of(mine[at]);
      out_.nodes.back().colour = colours.take[at];
    }
    for (std::size_t at = 0; at < mine.size(); ++at) {
      Group& group = group_[mine[at]];
      if (group.tell == none) continue;
      group.new_tell = add_node(rank, group.source, group.tell);
      out_.nodes.back().worker = owner_of(mine[at]);
      out_.nodes.back().colour = colours.tell[at];
      out_.nodes.back().tells = true;
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

  void connect() {
    std::vector<std::vector<std::uint32_t>> place(plans_.size());  // recorded node -> node
    for (std::size_t s = 0; s < plans_.size(); ++s) place[s].resize(plans_[s]->size(), none);
    for (std::uint32_t n = 0; n < out_.nodes.size(); ++n) {
      const SimNode& node = out_.nodes[n];
      if (node.role != Role::root) place[static_cast<std::size_t>(node.source_rank)][node.source_node] = n;
    }
    std::vector<std::vector<std::uint32_t>> extra(out_.nodes.size());
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
      extra[a].push_back(b);
      extra[b].push_back(a);
    };
    for (const Group& group : group_) {
      if (group.new_publish == none) continue;
      join(group.new_publish, group.new_glue);
      if (group.subdomain_colour > 0) {
        join(group.new_publish, group.new_take);
        join(group.new_glue, group.new_take);
      }
      if (group.new_tell != none) join(group.new_glue, group.new_tell);
      const std::uint32_t root = root_[out_.nodes[group.new_publish].rank];
      join(group.new_glue, root);
      if (group.teller() == none) continue;
      join(group.teller(), root);
      const std::uint32_t collect = collect_[out_.nodes[group.new_publish].rank];
      if (collect != none) join(group.teller(), collect);
    }
    for (const Plan* plan : plans_)
      for (const Message& m : plan->messages) {
        if (m.from == root_group || m.to == root_group) continue;
        const Group &from = group_[place_of(m.from)], &to = group_[place_of(m.to)];
        if (from.new_publish == none || to.new_glue == none)
          throw TraceError("a message between subdomains without gluing");
        if (out_.nodes[from.new_publish].rank == out_.nodes[to.new_glue].rank)
          join(from.new_publish, receiver(from, to));
      }
    out_.offset.push_back(0);
    for (std::uint32_t n = 0; n < out_.nodes.size(); ++n) {
      const SimNode& node = out_.nodes[n];
      if (node.role != Role::root) {
        const auto source = static_cast<std::size_t>(node.source_rank);
        for (std::uint32_t other : plans_[source]->neighbours(node.source_node)) {
          const std::uint32_t there = place[source][other];
          // Edges of the gluing follow from the messages; those of chunks are kept.
          if (there == none || out_.nodes[there].rank != node.rank) continue;
          if (node.role == Role::compute || out_.nodes[there].role == Role::compute)
            out_.neighbour.push_back(there);
        }
      }
      std::sort(extra[n].begin(), extra[n].end());
      extra[n].erase(std::unique(extra[n].begin(), extra[n].end()), extra[n].end());
      out_.neighbour.insert(out_.neighbour.end(), extra[n].begin(), extra[n].end());
      out_.offset.push_back(static_cast<std::uint32_t>(out_.neighbour.size()));
    }
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
          const std::uint32_t from = sender.new_publish, to = receiver(sender, taker);
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
