#include "runtime/graph/executor.hpp"

#include <omp.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include "runtime/trace/task_times.hpp"

namespace talus::graph {
namespace {

void push(std::vector<std::uint32_t>& heap, std::uint32_t task) {
  heap.push_back(task);
  std::push_heap(heap.begin(), heap.end(), std::greater<>{});
}

std::uint32_t pop(std::vector<std::uint32_t>& heap) {
  std::pop_heap(heap.begin(), heap.end(), std::greater<>{});
  const std::uint32_t task = heap.back();
  heap.pop_back();
  return task;
}

/// The lock is held for a few hundred ns at most, so polling costs far less than sleeping.
void lock_soon(std::unique_lock<std::mutex>& lock) {
  for (int attempt = 0; attempt < 200; ++attempt) {
    if (lock.try_lock()) return;
    pause();
  }
  lock.lock();
}

ExecutorOptions checked(const ExecutorOptions& options) {
  if (options.threads < 1)
    throw std::invalid_argument("an executor needs at least 1 thread, not " +
                                std::to_string(options.threads));
  return options;
}

}  // namespace

Executor::Executor(ExecutorOptions options)
    : options_(checked(options)), background_(options.background_capacity) {}

void Executor::submit_background(std::string name, std::function<void()> work) {
  background_.submit(std::move(name), std::move(work));
}

void Executor::drain() {
  background_.drain();
}

void Executor::run(const Graph& graph) {
  if (running_) throw std::logic_error("Executor::run was called by a task of the graph it runs");
  struct Running {
    bool& flag;
    explicit Running(bool& f) : flag(f) { flag = true; }
    ~Running() { flag = false; }
  } const running(running_);

  if (options_.threads == 1) {
    run_inline(graph);
    return;
  }
  prepare(graph);
  int granted = 0;
#pragma omp parallel num_threads(options_.threads) default(none) shared(graph, granted)
  {
    // A team built for more threads than there are would wait forever for the missing ones.
    if (omp_get_thread_num() == 0) granted = omp_get_num_threads();
    if (omp_get_num_threads() == options_.threads) serve(graph, omp_get_thread_num());
  }
  if (granted != options_.threads)
    throw std::runtime_error("OpenMP granted " + std::to_string(granted) + " of " +
                             std::to_string(options_.threads) +
                             " threads: raise OMP_THREAD_LIMIT, unset OMP_DYNAMIC, or ask for fewer threads");
  if (failure_) rethrow_as_task_error(graph.name(TaskId{failed_}), std::exchange(failure_, nullptr));
}

void Executor::run_inline(const Graph& graph) {
  Worker worker(0, 1, stop_);
  for (std::uint32_t i = 0; i < graph.size(); ++i) {
    const TaskId task{i};
    try {
      run_task(graph, task, worker);
    } catch (...) {
      rethrow_as_task_error(graph.name(task), std::current_exception());
    }
  }
}

void Executor::run_task(const Graph& graph, TaskId task, Worker& worker) {
  trace::Recorder* const trace = options_.trace && options_.trace->active() ? options_.trace : nullptr;
  const std::int64_t begin = trace ? trace->now() : 0;
  std::optional<GivenTime> given;
  if (options_.times && options_.times->active())
    given.emplace(options_.times->task(static_cast<std::uint32_t>(task)));
  if (graph.is_team(task))
    graph.run(task, worker);
  else
    graph.run(task);
  given.reset();
  if (trace) trace->task(worker.thread(), static_cast<std::uint32_t>(task), begin);
}

void Executor::prepare(const Graph& graph) {
  const std::size_t tasks = graph.size();
  first_successor_.assign(tasks + 1, 0);
  successors_.resize(graph.edge_count());
  missing_.resize(tasks);
  ready_tasks_.clear();
  ready_tasks_.reserve(tasks);
  ready_teams_.clear();
  ready_teams_.reserve(tasks);
  open_team_ = none;
  entered_.assign(static_cast<std::size_t>(options_.threads), 0);
  ended_ = 0;
  failed_ = none;
  failure_ = nullptr;
  stop_.lower();

  // Inverts the predecessor lists: count, sum up to the end of each range, then fill from the back, which
  // leaves the beginnings.
  for (std::uint32_t i = 0; i < tasks; ++i)
    for (const TaskId before : graph.predecessors(TaskId{i}))
      ++first_successor_[static_cast<std::size_t>(before)];
  std::uint32_t sum = 0;
  for (std::uint32_t& first : first_successor_) first = sum += first;
  for (auto i = static_cast<std::uint32_t>(tasks); i-- > 0;) {
    const auto before = graph.predecessors(TaskId{i});
    missing_[i] = static_cast<std::uint32_t>(before.size());
    for (const TaskId task : before) successors_[--first_successor_[static_cast<std::size_t>(task)]] = i;
    if (before.empty()) push(graph.is_team(TaskId{i}) ? ready_teams_ : ready_tasks_, i);
  }
}

void Executor::serve(const Graph& graph, int thread) noexcept {
  Worker worker(thread, options_.threads, stop_, options_.delay_seed);
  std::unique_lock lock(mutex_, std::defer_lock);
  lock_soon(lock);
  while (!stop_.raised() && ended_ < graph.size()) {
    const std::uint32_t next = take(thread);
    if (next == none) {
      await_change(lock);
      continue;
    }
    lock.unlock();
    std::exception_ptr failure;
    const TaskId task{next};
    try {
      worker.delay();
      run_task(graph, task, worker);
    } catch (...) {
      stop_.raise();  // at once: others may be waiting for this thread in the same team
      failure = std::current_exception();
    }
    lock_soon(lock);
    if (failure)
      record_failure(next, std::move(failure));
    else
      finish(graph, next);
  }
}

std::uint32_t Executor::take(int thread) {
  char& entered = entered_[static_cast<std::size_t>(thread)];
  if (open_team_ != none && entered == 0) {
    entered = 1;
    return open_team_;
  }
  const std::uint32_t task = ready_tasks_.empty() ? none : ready_tasks_.front();
  const std::uint32_t team = ready_teams_.empty() || open_team_ != none ? none : ready_teams_.front();
  if (task < team) return pop(ready_tasks_);
  if (team == none) return none;
  open_team_ = pop(ready_teams_);
  std::fill(entered_.begin(), entered_.end(), 0);
  entered = 1;
  inside_ = options_.threads;
  announce_change();
  return open_team_;
}

void Executor::finish(const Graph& graph, std::uint32_t task) {
  if (task == open_team_) {
    if (--inside_ > 0) return;
    open_team_ = none;
  }
  ++ended_;
  for (std::uint32_t i = first_successor_[task]; i < first_successor_[task + 1]; ++i) {
    const std::uint32_t next = successors_[i];
    if (--missing_[next] == 0) push(graph.is_team(TaskId{next}) ? ready_teams_ : ready_tasks_, next);
  }
  announce_change();
}

void Executor::record_failure(std::uint32_t task, std::exception_ptr failure) noexcept {
  if (task < failed_) {
    failed_ = task;
    failure_ = std::move(failure);
  }
  announce_change();
}

void Executor::announce_change() {
  changes_.store(changes_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  changed_.notify_all();
}

void Executor::await_change(std::unique_lock<std::mutex>& lock) {
  const std::uint64_t seen = changes_.load(std::memory_order_relaxed);
  const auto changed = [&] { return changes_.load(std::memory_order_relaxed) != seen; };
  // Waking a blocked thread costs tens of microseconds, as much as a short task: poll for about as long, then
  // free the core for the background thread and for other processes.
  constexpr int spins = 1000;
  constexpr int yields = 100;
  lock.unlock();
  for (int i = 0; i < spins && !changed(); ++i) pause();
  for (int i = 0; i < yields && !changed(); ++i) std::this_thread::yield();
  lock_soon(lock);
  changed_.wait(lock, changed);
}

}  // namespace talus::graph
