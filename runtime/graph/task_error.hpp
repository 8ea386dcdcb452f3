#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace talus::graph {

/// A task failed. what() is "task 'NAME': " and the message of the task's own exception, which is nested in
/// this one (std::rethrow_if_nested reaches it).
class TaskError : public std::runtime_error {
 public:
  TaskError(std::string task, const std::string& message)
      : std::runtime_error("task '" + task + "': " + message), task_(std::move(task)) {}

  const std::string& task() const noexcept { return task_; }

 private:
  std::string task_;
};

/// Throws `failure`, which was caught in `task`, as a TaskError with the original nested in it.
[[noreturn]] inline void rethrow_as_task_error(const std::string& task, const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    std::throw_with_nested(TaskError(task, error.what()));
  } catch (...) {
    std::throw_with_nested(TaskError(task, "an exception that is no std::exception"));
  }
}

}  // namespace talus::graph
