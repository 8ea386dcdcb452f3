/// The coarse tasks of a step as the executor runs them (runtime/graph/executor.hpp).

#include <algorithm>
#include <functional>
#include <map>
#include <queue>

#include "runtime/trace/detail/agenda.hpp"
#include "runtime/trace/detail/simulation.hpp"

namespace talus::trace::detail {

namespace {

/// The tasks of one part of a step on all ranks, while they run.
class TaskRun {
 public:
  TaskRun(Stage& stage, const StepTasks& tasks, const std::vector<double>& start)
      : stage_(stage), tasks_(tasks), rank_(tasks.begin.size()), left_(start) {
    for (std::uint32_t r = 0; r < rank_.size(); ++r) {
      prepare(r);
      dispatch(r, start[r]);
    }
  }

  /// Until all tasks have ended; returns when each rank's last one did.
  std::vector<double> run() {
    while (!agenda_.empty()) {
      const Event event = agenda_.next();
      const TimedTask& task = timed(event.a, event.b);
      if (event.what == work_ends && task.calls.count > 0 && rank_.size() > 1)
        come(event, task);
      else
        end(event, task);
    }
    return left_;
  }

 private:
  enum : std::uint32_t { work_ends, task_ends };
  struct Running {
    double begin, end;
    std::uint32_t thread;
  };
  struct Rank {
    std::vector<std::uint32_t> missing;  ///< per task of the part: predecessors that have not ended
    std::vector<std::vector<std::uint32_t>> successors;
    std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
    std::vector<std::uint32_t> idle;  ///< threads
    std::vector<Running> running;     ///< per task
  };
  /// A call of all ranks: who has come.
  struct Call {
    std::size_t came = 0;
    double last = 0;
    std::vector<std::uint32_t> task;  ///< per rank
  };

  const Task& task_of(std::uint32_t r, std::uint32_t i) const {
    return tasks_.tasks[r][tasks_.begin[r] + i].task;
  }
  const TimedTask& timed(std::uint32_t r, std::uint32_t i) const {
    return tasks_.timed[r][tasks_.begin[r] + i];
  }

  void prepare(std::uint32_t r) {
    const std::size_t begin = tasks_.begin[r], count = tasks_.end[r] - begin;
    Rank& rank = rank_[r];
    rank.missing.resize(count, 0);
    rank.successors.resize(count);
    rank.running.resize(count);
    for (auto t = static_cast<std::uint32_t>(stage_.machine.threads); t-- > 0;) rank.idle.push_back(t);
    for (std::uint32_t i = 0; i < count; ++i) {
      for (std::uint32_t before : task_of(r, i).predecessors)
        if (before >= begin) {
          rank.successors[before - begin].push_back(i);
          ++rank.missing[i];
        }
      if (rank.missing[i] == 0) rank.ready.push(i);
    }
  }

  /// Idle threads take the ready tasks that were submitted first.
  void dispatch(std::uint32_t r, double now) {
    Rank& rank = rank_[r];
    while (!rank.ready.empty() && (stage_.machine.unbounded || !rank.idle.empty())) {
      const std::uint32_t task = rank.ready.top();
      rank.ready.pop();
      std::uint32_t thread = 0;
      if (!stage_.machine.unbounded) {
        thread = rank.idle.back();
        rank.idle.pop_back();
      }
      rank.running[task] = {now, now + timed(r, task).work, thread};
      agenda_.add(rank.running[task].end, work_ends, r, task);
    }
  }

  /// A task has reached its call of all ranks. The last rank to come lets all go on.
  void come(const Event& event, const TimedTask& task) {
    const Kind kind = task_of(event.a, event.b).kind;
    Call& call = calls_[kind];
    call.task.resize(rank_.size());
    call.task[event.a] = event.b;
    call.last = std::max(call.last, event.time);
    if (++call.came < rank_.size()) return;
    const double known = call.last + stage_.network.time_of(task.calls);
    for (std::uint32_t other = 0; other < rank_.size(); ++other)
      agenda_.add(known, task_ends, other, call.task[other]);
    calls_.erase(kind);
  }

  void end(const Event& event, const TimedTask& task) {
    const std::uint32_t r = event.a, i = event.b;
    Rank& rank = rank_[r];
    const Running& run = rank.running[i];
    const std::uint32_t worker = stage_.log.worker(r, run.thread);
    const auto number = static_cast<std::uint32_t>(tasks_.begin[r] + i);
    stage_.log.task(worker, {run.begin, event.time, event.time - run.end}, {number, -1, task_of(r, i).kind});
    if (task.part > 0) stage_.log.span(worker, run.begin, run.begin + task.part, {0, -1, task.part_kind});
    stage_.log.calls(worker, run.begin, run.end, event.time, task.calls);
    rank.idle.push_back(run.thread);
    left_[r] = std::max(left_[r], event.time);
    for (std::uint32_t next : rank.successors[i])
      if (--rank.missing[next] == 0) rank.ready.push(next);
    dispatch(r, event.time);
  }

  Stage& stage_;
  const StepTasks& tasks_;
  std::vector<Rank> rank_;
  std::map<Kind, Call> calls_;
  Agenda agenda_;
  std::vector<double> left_;
};

}  // namespace

std::vector<double> play_tasks(Stage& stage, const StepTasks& tasks, const std::vector<double>& start) {
  return TaskRun(stage, tasks, start).run();
}

}  // namespace talus::trace::detail
