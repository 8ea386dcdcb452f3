/// Which subdomains there are, on which rank each comes, and the tasks of every step there.

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "runtime/graph/epoch_graph.hpp"
#include "runtime/trace/layout.hpp"

namespace talus::trace {

std::vector<std::uint32_t> groups_of(const Trace& trace) {
  std::set<std::uint32_t> groups;
  for (const Plan& plan : trace.plans)
    for (std::uint32_t group : plan.group)
      if (group != root_group) groups.insert(group);
  for (const auto& tasks : trace.tasks)
    for (const Task& task : tasks)
      if (task.group >= 0) groups.insert(static_cast<std::uint32_t>(task.group));
  return {groups.begin(), groups.end()};
}

std::vector<std::uint32_t> map_groups(const std::vector<std::uint64_t>& weight, const Machine& machine) {
  const std::size_t groups = weight.size();
  const auto ranks = static_cast<std::size_t>(machine.ranks);
  std::vector<std::uint32_t> rank_of(groups);
  if (machine.map == RankMap::weight) {
    const std::uint64_t most = std::max<std::uint64_t>(1, *std::max_element(weight.begin(), weight.end()));
    std::vector<std::uint32_t> small;
    for (std::uint64_t w : weight) small.push_back(static_cast<std::uint32_t>(1 + w * 1000000 / most));
    graph::assign_owners(small, machine.ranks, rank_of);
    // No rank may be left without: the last groups move up.
    for (std::size_t g = groups; g-- > 0;) {
      const auto at_most = static_cast<std::uint32_t>(std::min(ranks - 1, g));
      const auto at_least = static_cast<std::uint32_t>(ranks - std::min(ranks, groups - g));
      rank_of[g] = std::clamp(rank_of[g], std::min(at_least, at_most), at_most);
    }
    for (std::size_t g = 1; g < groups; ++g) rank_of[g] = std::min(rank_of[g], rank_of[g - 1] + 1);
    return rank_of;
  }
  for (std::size_t g = 0; g < groups; ++g)
    rank_of[g] = static_cast<std::uint32_t>(machine.map == RankMap::cyclic ? g % ranks : g * ranks / groups);
  return rank_of;
}

std::vector<std::vector<SimTask>> lay_out_tasks(const Trace& trace, const std::vector<std::uint32_t>& groups,
                                                const std::vector<std::uint32_t>& rank_of, int ranks) {
  std::vector<std::vector<SimTask>> all(static_cast<std::size_t>(ranks));
  for (std::uint32_t r = 0; r < all.size(); ++r) {
    std::set<std::int32_t> mine;
    for (std::size_t g = 0; g < groups.size(); ++g)
      if (rank_of[g] == r) mine.insert(static_cast<std::int32_t>(groups[g]));
    std::vector<SimTask>& tasks = all[r];
    std::map<std::pair<std::size_t, std::uint32_t>, std::uint32_t> place;  // recorded (rank, task) -> task
    // All recorded ranks have the same kinds in the same order, each with its own subdomains' tracks.
    std::vector<std::size_t> next(trace.tasks.size(), 0);
    while (next[0] < trace.tasks[0].size()) {
      const Kind kind = trace.tasks[0][next[0]].kind;
      for (std::size_t s = 0; s < trace.tasks.size(); ++s)
        for (const auto& recorded = trace.tasks[s];
             next[s] < recorded.size() && recorded[next[s]].kind == kind; ++next[s]) {
          const Task& task = recorded[next[s]];
          if (task.group >= 0 && !mine.count(task.group)) continue;
          const bool merged = task.group < 0 && !tasks.empty() && tasks.back().task.kind == kind &&
                              tasks.back().task.group < 0;
          if (!merged) {
            tasks.push_back({{task.name, kind, task.group, task.team, {}}, {}});
          }
          tasks.back().sources.push_back({static_cast<std::int32_t>(s), static_cast<std::uint32_t>(next[s])});
          place[{s, static_cast<std::uint32_t>(next[s])}] = static_cast<std::uint32_t>(tasks.size() - 1);
        }
    }
    for (SimTask& task : tasks) {
      std::set<std::uint32_t> before;
      for (const SimTask::Source& source : task.sources)
        for (std::uint32_t p : trace.tasks[static_cast<std::size_t>(source.rank)][source.task].predecessors)
          if (const auto found = place.find({static_cast<std::size_t>(source.rank), p}); found != place.end())
            before.insert(found->second);
      task.task.predecessors.assign(before.begin(), before.end());
    }
  }
  return all;
}

}  // namespace talus::trace
