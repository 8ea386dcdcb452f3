#include "runtime/trace/timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <queue>
#include <tuple>

namespace talus::trace {
namespace {

/// Kinds that some task of a step has.
bool names_task(const Trace& trace, Kind kind) {
  for (const auto& tasks : trace.tasks)
    for (const Task& task : tasks)
      if (task.kind == kind) return true;
  return false;
}

/// Makes room up to this epoch. Nodes and checks both call it: the nodes of a step without contacts leave no
/// record when all subdomains are on one rank, and its check is then all that tells how many epochs it had.
void reach_epoch(StepIndex::Rank& rank, std::size_t epoch) {
  const std::size_t epochs = epoch + 1;
  if (rank.epochs >= epochs) return;
  rank.epochs = epochs;
  rank.node.resize(epochs * rank.nodes);
  rank.check.resize(epochs);
  rank.awaited.resize(epochs, 0);
  rank.settled.resize(epochs, 0);
  rank.whole.resize(epochs);
  rank.alone.resize(epochs);
}

}  // namespace

std::vector<std::vector<float>> self_times(const Trace& trace) {
  std::vector<std::vector<float>> all(trace.tracks.size());
  std::vector<std::size_t> open;
  for (std::size_t k = 0; k < trace.tracks.size(); ++k) {
    const std::vector<Record>& records = trace.tracks[k].records;
    std::vector<float>& self = all[k];
    self.resize(records.size());
    open.clear();
    for (std::size_t i = 0; i < records.size(); ++i) {
      self[i] = records[i].duration;
      while (!open.empty() && records[open.back()].end() <= static_cast<double>(records[i].begin))
        open.pop_back();
      if (!open.empty()) {
        float& around = self[open.back()];
        around = std::max(0.0F, around - records[i].duration);
      }
      open.push_back(i);
    }
  }
  return all;
}

std::vector<std::uint32_t> steps_of(const Trace& trace) {
  std::vector<std::uint32_t> steps;
  std::vector<char> task(trace.kinds.size(), 0);
  for (std::size_t k = 0; k < task.size(); ++k) task[k] = names_task(trace, static_cast<Kind>(k)) ? 1 : 0;
  for (int thread = 0; thread < trace.threads; ++thread)
    for (const Record& record : trace.track(0, thread).records)
      if (task[static_cast<std::size_t>(record.kind())] && (steps.empty() || steps.back() != record.step()))
        steps.push_back(record.step());
  std::sort(steps.begin(), steps.end());
  steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
  return steps;
}

std::unordered_map<const Record*, const Record*> sends_of(const Trace& trace) {
  const auto name = [](const Record* record) {
    return std::tuple(record->step(), record->epoch, record->node);
  };
  const auto in_time = [&](const Record* record) {
    const bool waits = record->kind() == kind_receive;
    return std::tuple(name(record), waits ? record->end() : static_cast<double>(record->begin), waits);
  };
  std::vector<const Record*> messages;
  for (const Track& track : trace.tracks)
    for (const Record& record : track.records)
      if (record.kind() == kind_send || record.kind() == kind_receive) messages.push_back(&record);
  std::ranges::sort(messages, {}, in_time);
  std::unordered_map<const Record*, const Record*> sends;
  std::queue<const Record*> waits;
  for (auto last = messages.rbegin(); last != messages.rend(); ++last) {
    const Record* const record = *last;
    if (!waits.empty() && name(waits.front()) != name(record)) waits = {};
    if (record->kind() == kind_receive) {
      waits.push(record);
    } else if (!waits.empty()) {
      sends[waits.front()] = record;
      waits.pop();
    }
  }
  return sends;
}

Timeline::Timeline(const Trace& trace) : trace_(trace), self_(self_times(trace)), steps_(steps_of(trace)) {
  if (steps_.empty()) throw TraceError("the trace holds no step of a run");
}

void Timeline::add(const Track& track, std::uint32_t number, StepIndex& index) const {
  const auto by_step = [](const Record& record, std::uint32_t step) { return record.step() < step; };
  const auto first = std::lower_bound(track.records.begin(), track.records.end(), index.step, by_step);
  StepIndex::Rank& rank = index.ranks[static_cast<std::size_t>(track.rank)];
  const std::vector<Task>& tasks = trace_.tasks[static_cast<std::size_t>(track.rank)];
  Place last_task, last_check;
  // By its beginning: ends of long ones are rounded.
  const auto within = [&](const Record& span, Place place) {
    return place.exists() && static_cast<double>(span.begin) < record(place).end();
  };
  for (auto it = first; it != track.records.end() && it->step() == index.step; ++it) {
    const Place place{number, static_cast<std::uint32_t>(it - track.records.begin())};
    const Kind kind = it->kind();
    if (kind == kind_team || kind == kind_send || kind == kind_receive) continue;
    if (kind == kind_outside) {
      rank.outside = place;
    } else if (kind == kind_collective) {
      if (within(*it, last_check)) {
        const auto epoch = static_cast<std::size_t>(record(last_check).epoch);
        if (rank.whole[epoch].empty() || !within(*it, rank.whole[epoch].back())) ++rank.awaited[epoch];
      } else if (within(*it, last_task)) {
        rank.calls[record(last_task).node].add(it->node);
      } else if (within(*it, rank.outside)) {
        rank.calls_outside.add(it->node);
      }
    } else if (kind == kind_check) {
      const auto epoch = static_cast<std::size_t>(it->epoch);
      reach_epoch(rank, epoch);
      rank.check[epoch] = last_check = place;
      rank.settled[epoch] = it->node == check_settles ? 1 : 0;
    } else if (it->epoch >= 0) {
      if (it->node >= rank.nodes)
        throw TraceError(fmt::format("step {}: node {} of a plan of {} on rank {}", index.step, it->node,
                                     rank.nodes, track.rank));
      const auto epoch = static_cast<std::size_t>(it->epoch);
      reach_epoch(rank, epoch);
      Place& once = rank.node[epoch * rank.nodes + it->node];
      if (once.exists())
        throw TraceError(fmt::format("step {}: node {} of epoch {} was recorded twice on rank {}", index.step,
                                     it->node, epoch, track.rank));
      once = place;
    } else if (it->node < tasks.size() && tasks[it->node].kind == kind && !tasks[it->node].team) {
      rank.task[it->node] = last_task = place;
    } else if (within(*it, last_task)) {
      rank.part[record(last_task).node] = place;
    } else if (within(*it, last_check)) {
      const auto epoch = static_cast<std::size_t>(record(last_check).epoch);
      if (trace_.info(kind).shared)
        rank.alone[epoch] = place;
      else
        rank.whole[epoch].push_back(place);
    }
  }
}

StepIndex Timeline::index(std::uint32_t step) const {
  StepIndex index;
  index.step = step;
  index.ranks.resize(static_cast<std::size_t>(trace_.ranks));
  for (int r = 0; r < trace_.ranks; ++r) {
    StepIndex::Rank& rank = index.ranks[static_cast<std::size_t>(r)];
    rank.plan = plan_of(trace_, r, step);
    rank.nodes = rank.plan ? rank.plan->size() : 0;
    rank.task.resize(trace_.tasks[static_cast<std::size_t>(r)].size());
    rank.calls.resize(rank.task.size());
    rank.part.resize(rank.task.size());
  }
  for (std::uint32_t k = 0; k < trace_.tracks.size(); ++k) add(trace_.tracks[k], k, index);
  for (int r = 0; r < trace_.ranks; ++r) {
    StepIndex::Rank& rank = index.ranks[static_cast<std::size_t>(r)];
    const auto incomplete = [&](const std::string& what) {
      throw TraceError(fmt::format(
          "step {} was recorded in part: {} of rank {} is missing. Choose whole steps, or record anew", step,
          what, r));
    };
    const std::vector<Task>& tasks = trace_.tasks[static_cast<std::size_t>(r)];
    for (std::size_t i = 0; i < tasks.size(); ++i)
      if (!tasks[i].team && !rank.task[i].exists()) incomplete("task " + tasks[i].name);
    if (rank.epochs > 0 && !rank.check.back().exists()) incomplete("the last decision");
    for (std::size_t e = 0; e < rank.epochs; ++e)
      for (std::size_t n = 0; n < rank.nodes; ++n)
        if (rank.plan->role[n] == static_cast<std::uint8_t>(Role::compute) && !rank.at(e, n).exists())
          incomplete(fmt::format("node {} in epoch {}", n, e));
  }
  return index;
}

graph::Tree tree_of(const StepIndex& index) {
  std::vector<graph::RankLoad> load(index.ranks.size());
  for (std::size_t r = 0; r < index.ranks.size(); ++r)
    if (index.ranks[r].plan)
      add_load(
          *index.ranks[r].plan, [&](std::uint32_t) { return r; }, load);
  return graph::grow_tree(load);
}

}  // namespace talus::trace
