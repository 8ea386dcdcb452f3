/// The coarse tasks of a step as the executor runs them (runtime/graph/executor.hpp).

#include <algorithm>
#include <map>

#include "runtime/trace/detail/agenda.hpp"
#include "runtime/trace/detail/simulation.hpp"

namespace talus::trace::detail {

std::vector<double> play_tasks(Stage& stage, const std::vector<std::vector<SimTask>>& tasks,
                               const std::vector<std::vector<TimedTask>>& timed,
                               const std::vector<std::size_t>& begin, const std::vector<std::size_t>& end,
                               const std::vector<double>& start) {
  struct Rank {
    std::vector<std::uint32_t> missing;  ///< per task of the part
    std::vector<std::vector<std::uint32_t>> successors;
    std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
    std::vector<std::uint32_t> idle;
  };
  struct Running {
    double begin, end;
    std::uint32_t thread;
  };
  /// A call of all ranks: who has come.
  struct Call {
    int came = 0;
    double last = 0;
    std::vector<std::uint32_t> task;  ///< per rank
  };
  enum : std::uint32_t { work_ends, task_ends };
  const std::size_t ranks = tasks.size();
  std::vector<Rank> state(ranks);
  std::vector<std::vector<Running>> running(ranks);
  std::map<Kind, Call> calls;
  Agenda agenda;
  std::vector<double> left = start;

  const auto dispatch = [&](std::uint32_t r, double now) {
    Rank& rank = state[r];
    while (!rank.ready.empty() && (stage.machine.unbounded || !rank.idle.empty())) {
      const std::uint32_t task = rank.ready.top();
      rank.ready.pop();
      std::uint32_t thread = 0;
      if (!stage.machine.unbounded) {
        thread = rank.idle.back();
        rank.idle.pop_back();
      }
      running[r][task] = {now, now + timed[r][begin[r] + task].work, thread};
      agenda.add(running[r][task].end, work_ends, r, task);
    }
  };
  for (std::uint32_t r = 0; r < ranks; ++r) {
    const std::size_t count = end[r] - begin[r];
    Rank& rank = state[r];
    rank.missing.resize(count, 0);
    rank.successors.resize(count);
    running[r].resize(count);
    for (auto t = static_cast<std::uint32_t>(stage.machine.threads); t-- > 0;) rank.idle.push_back(t);
    for (std::uint32_t i = 0; i < count; ++i) {
      for (std::uint32_t before : tasks[r][begin[r] + i].task.predecessors)
        if (before >= begin[r]) {
          rank.successors[before - begin[r]].push_back(i);
          ++rank.missing[i];
        }
      if (rank.missing[i] == 0) rank.ready.push(i);
    }
    dispatch(r, start[r]);
  }
  while (!agenda.empty()) {
    const Event event = agenda.next();
    const std::uint32_t r = event.a, i = event.b;
    const TimedTask& task = timed[r][begin[r] + i];
    const Kind kind = tasks[r][begin[r] + i].task.kind;
    if (event.what == work_ends && task.calls.count > 0 && ranks > 1) {
      Call& call = calls[kind];
      call.task.resize(ranks);
      call.task[r] = i;
      call.last = std::max(call.last, event.time);
      if (++call.came < static_cast<int>(ranks)) continue;
      const double known = call.last + stage.network.time_of(task.calls);
      for (std::uint32_t other = 0; other < ranks; ++other)
        agenda.add(known, task_ends, other, call.task[other]);
      calls.erase(kind);
      continue;
    }
    const Running& run = running[r][i];
    const std::uint32_t worker = stage.log.worker(r, run.thread);
    stage.log.task(worker, run.begin, event.time, event.time - run.end,
                   static_cast<std::uint32_t>(begin[r] + i), -1, kind);
    if (task.part > 0) stage.log.span(worker, run.begin, run.begin + task.part, 0, -1, task.part_kind);
    stage.log.calls(worker, run.begin, run.end, event.time, task.calls);
    Rank& rank = state[r];
    rank.idle.push_back(run.thread);
    left[r] = std::max(left[r], event.time);
    for (std::uint32_t next : rank.successors[i])
      if (--rank.missing[next] == 0) rank.ready.push(next);
    dispatch(r, event.time);
  }
  return left;
}

}  // namespace talus::trace::detail
