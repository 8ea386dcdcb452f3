#include "runtime/graph/background.hpp"

#include <stdexcept>
#include <utility>

#include "runtime/graph/task_error.hpp"

namespace talus::graph {

BackgroundThread::BackgroundThread(std::size_t capacity) : capacity_(capacity) {
  if (capacity == 0) throw std::invalid_argument("a background thread needs room for at least one task");
}

BackgroundThread::~BackgroundThread() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void BackgroundThread::submit(std::string name, std::function<void()> work) {
  if (!work) throw std::invalid_argument("background task '" + name + "' has no work");
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return queue_.size() < capacity_; });
    report_failure();
    queue_.push_back({std::move(name), std::move(work)});
    if (!thread_.joinable()) thread_ = std::thread([this] { serve(); });
  }
  changed_.notify_all();
}

void BackgroundThread::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return queue_.empty(); });
  report_failure();
}

void BackgroundThread::report_failure() {
  if (failure_) rethrow_as_task_error(std::exchange(failed_, {}), std::exchange(failure_, nullptr));
}

void BackgroundThread::serve() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return closing_ || !queue_.empty(); });
    if (queue_.empty()) return;
    Task& task = queue_.front();  // stays in the queue while it runs, so that it counts as outstanding
    lock.unlock();
    std::exception_ptr failure;
    try {
      task.work();
    } catch (...) {
      failure = std::current_exception();
    }
    task.work = nullptr;  // captures may be large: release them before the lock is taken
    lock.lock();
    if (failure) {
      failed_ = std::move(task.name);
      failure_ = std::move(failure);
      queue_.clear();
    } else {
      queue_.pop_front();
    }
    changed_.notify_all();
  }
}

}  // namespace talus::graph
