#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace talus::graph {

/// One thread that runs tasks in order of submission beside everything else: files are written while the next
/// steps are computed. Tasks own what they write (plain copies), so no result can depend on when they run.
/// The queue is bounded: a slow disk holds the simulation back instead of filling the memory.
class BackgroundThread {
 public:
  /// At most `capacity` >= 1 tasks wait or run at a time.
  explicit BackgroundThread(std::size_t capacity);
  /// Runs what is outstanding; a failure that was not reported yet is lost, so call drain() first.
  ~BackgroundThread();
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  /// Queues a task; blocks while `capacity` tasks are outstanding. The first call starts the thread. Throws
  /// TaskError, and queues nothing, if an earlier task has failed since the last report. A task of this lane
  /// must not call it.
  void submit(std::string name, std::function<void()> work);

  /// Returns when no task is outstanding. Throws TaskError if one has failed since the last report; tasks
  /// queued behind the one that failed were not begun. A task of this lane must not call it.
  void drain();

 private:
  struct Task {
    std::string name;
    std::function<void()> work;
  };

  void serve();
  void report_failure();  ///< throws the failure once; mutex_ is held

  const std::size_t capacity_;
  std::mutex mutex_;                 ///< guards all below
  std::condition_variable changed_;  ///< a task came, a task ended, or it closes
  std::deque<Task> queue_;           ///< outstanding; the front is running
  bool closing_ = false;
  std::string failed_;  ///< name of the task that threw failure_
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace talus::graph
