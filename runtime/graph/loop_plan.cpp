#include "runtime/graph/loop_plan.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>

namespace talus::graph {

namespace {

constexpr std::uint32_t none = LoopPlan::none;

/// Fills a LoopPlan: its nodes, in the order of their numbers, then their conflicts and owners.
class Planner {
 public:
  Planner(const LoopSpec& spec, const Tree& tree) : spec_(spec), colours_(loop_colours(spec, tree)) {}

  LoopPlan plan() {
    add_nodes();
    connect_work();
    connect_groups();
    fill_conflicts();
    find_owners();
    return std::move(out_);
  }

 private:
  /// The nodes of a group other than its work.
  struct GroupNodes {
    std::uint32_t publish = none, glue = none, take = none, tell = none;
  };

  std::uint32_t add(LoopRole role, std::uint32_t group, std::uint32_t colour) {
    out_.nodes.push_back({role, group});
    out_.colour.push_back(colour);
    return static_cast<std::uint32_t>(out_.nodes.size() - 1);
  }

  void add_nodes() {
    const auto groups = static_cast<std::uint32_t>(spec_.groups.size());
    for (std::size_t k = 0; k < spec_.work.size(); ++k)
      add(LoopRole::work, spec_.work[k].group, colours_.work[k]);
    of_group_.resize(groups);
    for (std::uint32_t e = 0; e < groups; ++e)
      if (spec_.groups[e].exchanges) of_group_[e].publish = add(LoopRole::publish, e, colours_.publish[e]);
    if (out_.nodes.size() == spec_.work.size()) return;  // no group exchanges anything
    if (spec_.collects) collect_ = add(LoopRole::collect, none, colours_.tree.up);
    root_ = add(LoopRole::root, none, colours_.tree.down);
    for (std::uint32_t e = 0; e < groups; ++e)
      if (spec_.groups[e].exchanges) of_group_[e].glue = add(LoopRole::glue, e, colours_.glue);
    for (std::uint32_t e = 0; e < groups; ++e)
      if (spec_.groups[e].exchanges && spec_.groups[e].colour > 0)
        of_group_[e].take = add(LoopRole::take, e, colours_.take[e]);
    for (std::uint32_t e = 0; e < groups; ++e)
      if (spec_.groups[e].exchanges && spec_.groups[e].tells)
        of_group_[e].tell = add(LoopRole::tell, e, colours_.tell[e]);
  }

  void join(std::uint32_t a, std::uint32_t b) {
    if (a != none && b != none) edges_.emplace_back(a, b);
  }

  /// Work whose results other groups read conflicts with the nodes of its group that read or write what is
  /// exchanged.
  void connect_work() {
    for (std::uint32_t node = 0; node < spec_.work.size(); ++node) {
      const LoopWork& work = spec_.work[node];
      if (work.side == LoopWork::inside) continue;
      const GroupNodes& group = of_group_[work.group];
      for (const std::uint32_t other : {group.publish, group.glue, group.take}) join(node, other);
      if (work.side == LoopWork::early) join(node, group.tell);
    }
  }

  void connect_groups() {
    for (std::size_t e = 0; e < of_group_.size(); ++e) {
      const GroupNodes& own = of_group_[e];
      join(own.publish, own.glue);
      join(own.publish, own.take);
      join(own.glue, own.take);
      join(own.glue, own.tell);
      if (own.glue != none) join(own.glue, root_);
      const char colour = spec_.groups[e].colour;
      const std::uint32_t teller = own.tell != none ? own.tell : colour == 0 ? own.publish : none;
      join(teller, collect_);
      join(teller, root_);
      for (const std::uint32_t reader : spec_.groups[e].readers)
        join(own.publish,
             colour < spec_.groups[reader].colour ? of_group_[reader].take : of_group_[reader].glue);
    }
  }

  void fill_conflicts() {
    const std::size_t nodes = out_.nodes.size(), work = spec_.work.size();
    const auto own = [&](std::size_t node) {
      return node < work ? std::span(spec_.neighbour)
                               .subspan(spec_.offset[node], spec_.offset[node + 1] - spec_.offset[node])
                         : std::span<const std::uint32_t>();
    };
    std::vector<std::uint32_t> count(nodes, 0);
    for (const auto& [a, b] : edges_) ++count[a], ++count[b];
    out_.offset.assign(1, 0);
    for (std::size_t node = 0; node < nodes; ++node)
      out_.offset.push_back(out_.offset.back() + count[node] + static_cast<std::uint32_t>(own(node).size()));
    out_.neighbour.resize(out_.offset.back());
    std::vector<std::uint32_t> next(out_.offset.begin(), out_.offset.end() - 1);
    for (std::size_t node = 0; node < work; ++node)
      for (const std::uint32_t other : own(node)) out_.neighbour[next[node]++] = other;
    for (const auto& [a, b] : edges_) {
      out_.neighbour[next[a]++] = b;
      out_.neighbour[next[b]++] = a;
    }
  }

  /// Work is shared out in order of place. The nodes of a group's exchange go to the thread of its first
  /// work.
  void find_owners() {
    const std::size_t count = spec_.work.size();
    std::vector<std::uint32_t> order(count), weight(count), group(count), owner(count);
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::tie(spec_.work[a].group, spec_.work[a].place) <
             std::tie(spec_.work[b].group, spec_.work[b].place);
    });
    for (std::size_t k = 0; k < count; ++k) {
      weight[k] = spec_.work[order[k]].weight;
      group[k] = spec_.work[order[k]].group;
    }
    assign_owners(weight, group, spec_.threads, owner);
    out_.owner.assign(out_.nodes.size(), 0);
    std::vector<std::uint32_t> of_group(spec_.groups.size(), 0);
    for (std::size_t k = count; k-- > 0;) out_.owner[order[k]] = of_group[group[k]] = owner[k];
    if (spec_.only_first_thread_exchanges) return;
    for (std::size_t node = count; node < out_.nodes.size(); ++node)
      if (out_.nodes[node].group != none) out_.owner[node] = of_group[out_.nodes[node].group];
  }

  const LoopSpec& spec_;
  LoopColours colours_;
  std::vector<GroupNodes> of_group_;
  std::uint32_t collect_ = none, root_ = none;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_;  ///< conflicts, except within the work
  LoopPlan out_;
};

}  // namespace

LoopPlan plan_loop(const LoopSpec& spec, const Tree& tree) {
  return Planner(spec, tree).plan();
}

}  // namespace talus::graph
