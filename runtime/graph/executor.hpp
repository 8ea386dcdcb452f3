#pragma once

/// Runs graphs on OpenMP threads, and background tasks on a thread of their own.
///
/// One run: all threads share a queue of ready tasks, guarded by one mutex; each takes the ready task that
/// was submitted first. Once a thread has taken a team task, every other thread enters it when its current
/// task has ended. Only one team task is open at a time, so two teams cannot wait for each other's threads.
/// Tasks here are coarse (tens of microseconds and more); work in pieces of a few microseconds belongs in a
/// team that runs an epoch loop (epoch_loop.hpp).

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <mutex>
#include <string>
#include <vector>

#include "runtime/graph/background.hpp"
#include "runtime/graph/graph.hpp"
#include "runtime/graph/task_error.hpp"
#include "runtime/graph/worker.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::trace {
class TaskTimes;
}

namespace talus::graph {

struct ExecutorOptions {
  int threads = 1;  ///< >= 1; may exceed the cores, at a loss of speed only
  std::uint64_t delay_seed =
      0;  ///< not 0: before each task and loop node spin a pseudo-random time (tests of order)
  std::size_t background_capacity =
      4;  ///< >= 1: background tasks that may be outstanding before submit_background blocks
  trace::Recorder* trace =
      nullptr;  ///< records each task, if given; made for as many threads, outlives the executor
  trace::TaskTimes* times = nullptr;  ///< durations of tasks on simulated ranks; outlives the executor
};

class Executor {
 public:
  /// Throws std::invalid_argument when an option is out of its range. Starts no thread.
  explicit Executor(ExecutorOptions options);

  int threads() const noexcept { return options_.threads; }
  trace::Recorder* trace() const noexcept { return options_.trace; }
  trace::TaskTimes* times() const noexcept { return options_.times; }

  /// Runs all tasks of the graph in an order that its edges allow; returns when all have ended. With one
  /// thread they run inline, in the order of submission, without locks or atomics. When a task throws, no
  /// further task is begun, teams are asked to leave (Worker::stopped), and run throws TaskError once every
  /// thread is back. If several tasks have failed, it reports the one submitted first. Throws
  /// std::runtime_error when OpenMP does not grant the threads, std::logic_error when called from one of the
  /// tasks. Called by one thread at a time.
  void run(const Graph& graph);

  /// Queues work for the background thread, see BackgroundThread::submit. Its thread starts with the first
  /// call.
  void submit_background(std::string name, std::function<void()> work);
  /// Waits for the background thread, see BackgroundThread::drain. Returns at once if it was never used.
  void drain();

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  void run_inline(const Graph& graph);
  void run_task(const Graph& graph, TaskId task, Worker& worker);
  void prepare(const Graph& graph);
  void serve(const Graph& graph, int thread) noexcept;
  std::uint32_t take(int thread);
  void finish(const Graph& graph, std::uint32_t task);
  void record_failure(std::uint32_t task, std::exception_ptr failure) noexcept;
  void announce_change();
  void await_change(std::unique_lock<std::mutex>& lock);

  const ExecutorOptions options_;
  bool running_ = false;  ///< touched by the caller of run and, if misused, by its tasks on the same thread

  // State of the run. Sized by prepare, so that nothing is allocated, and nothing can throw, between tasks.
  std::mutex mutex_;                            ///< guards all below except stop_ and changes_
  std::condition_variable changed_;             ///< notified with every increment of changes_
  std::vector<std::uint32_t> first_successor_;  ///< per task, and the end: its range in successors_
  std::vector<std::uint32_t> successors_;
  std::vector<std::uint32_t> missing_;      ///< per task: predecessors that have not ended
  std::vector<std::uint32_t> ready_tasks_;  ///< min-heap by id
  std::vector<std::uint32_t> ready_teams_;  ///< min-heap by id
  std::uint32_t open_team_ = none;
  std::vector<char> entered_;  ///< per thread: has entered the open team
  int inside_ = 0;             ///< threads that have not yet returned from, or entered, the open team
  std::size_t ended_ = 0;
  std::uint32_t failed_ = none;
  std::exception_ptr failure_;
  StopFlag stop_;
  /// Counts changes that may give a waiting thread work. Written under mutex_, read without it by threads
  /// that spin before they block. Relaxed: what has changed is read under the mutex afterwards.
  alignas(cache_line) std::atomic<std::uint64_t> changes_{0};

  BackgroundThread background_;
};

}  // namespace talus::graph
