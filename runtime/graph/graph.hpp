#pragma once

/// Tasks and the data they touch. The order of tasks follows from what each declares to read and write, never
/// from waits:
///
///     Graph step;
///     const Handle poses = step.data("poses");
///     // Eight parts, each with readers and writers of its own.
///     const Handles cells = step.data("cells", 8);
///     step.task("predict", {write(poses)}, [&] { ... });
///     // All eight after predict, beside each other.
///     for (std::uint32_t i = 0; i < 8; ++i)
///       step.task("bin", {read(poses), write(cells[i])}, [&, i] { ... });
///     // All threads together, after the eight.
///     step.team("iterate", {read(cells)}, [&](Worker& me) { ... });
///     executor.run(step);
///
/// The result is that of running the tasks one after the other in the order of submission: a reader comes
/// after the last writer before it, a writer after the last writer and all readers since (superscalar
/// scheduling, as in StarPU or DLA-Future).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "runtime/graph/worker.hpp"

namespace talus::graph {

/// A piece of data in one graph, known by its number only.
enum class Handle : std::uint32_t {};

/// Place of a task in the order of submission, from 0.
enum class TaskId : std::uint32_t {};

/// `count` handles with consecutive numbers.
struct Handles {
  Handle first{};
  std::uint32_t count = 0;
  /// `part` < count.
  Handle operator[](std::uint32_t part) const noexcept {
    return Handle{static_cast<std::uint32_t>(first) + part};
  }
};

/// What a task does with one handle, or with all parts of a range.
struct Access {
  Handles handles;
  bool writes = false;
};

inline Access read(Handle handle) noexcept {
  return {{handle, 1}, false};
}
inline Access read(Handles handles) noexcept {
  return {handles, false};
}
/// Writing includes reading what was there.
inline Access write(Handle handle) noexcept {
  return {{handle, 1}, true};
}
inline Access write(Handles handles) noexcept {
  return {handles, true};
}

class Graph {
 public:
  /// Names a piece of data; the name appears in errors and pictures and need not be unique.
  Handle data(std::string name);
  /// The same for `count` parts, named "name[0]", "name[1]", ...
  Handles data(std::string name, std::uint32_t count);

  /// Adds a task that one thread runs. A handle may be named several times; one write makes it written.
  /// Throws std::invalid_argument when a handle is not of this graph or `work` is empty.
  TaskId task(std::string name, const std::vector<Access>& accesses, std::function<void()> work);

  /// Adds a task that every thread of the executor enters, each with its own Worker. It has ended when all
  /// have returned. Teams that wait for one another inside must leave when Worker::stopped().
  TaskId team(std::string name, const std::vector<Access>& accesses, std::function<void(Worker&)> work);

  /// Forgets tasks and data, keeps the memory: a step's graph is rebuilt without allocating, apart from long
  /// names and captures.
  void clear() noexcept;

  std::size_t size() const noexcept { return tasks_.size(); }
  std::size_t data_count() const noexcept { return last_.size(); }
  std::size_t edge_count() const noexcept { return predecessors_.size(); }

  const std::string& name(TaskId task) const { return at(task).name; }
  std::string name(Handle handle) const;
  bool is_team(TaskId task) const { return static_cast<bool>(at(task).team); }
  /// Tasks that must have ended before `task` begins: each once, all with smaller ids. Some of those that
  /// others imply are left out.
  std::span<const TaskId> predecessors(TaskId task) const;

  /// Runs the work of a plain task / one thread's part of a team task; for executors.
  void run(TaskId task) const { at(task).work(); }
  void run(TaskId task, Worker& worker) const { at(task).team(worker); }

 private:
  static constexpr std::uint32_t none = 0xffffffffU;

  struct Task {
    std::string name;
    std::function<void()> work;
    std::function<void(Worker&)> team;
    std::size_t first_predecessor = 0;  ///< in predecessors_, up to that of the next task
  };
  struct DataName {
    std::string name;
    Handles handles;
    bool range = false;
  };
  /// What a handle's next user must wait for.
  struct LastUse {
    std::uint32_t writer = none;   ///< last task that wrote
    std::uint32_t readers = none;  ///< head of the list, in readers_, of tasks that have read since
  };
  struct Reader {
    std::uint32_t task;
    std::uint32_t next;
  };

  const Task& at(TaskId task) const { return tasks_.at(static_cast<std::size_t>(task)); }
  TaskId add(Task task, const std::vector<Access>& accesses);
  void add_read(std::uint32_t task, std::uint32_t handle);
  void add_write(std::uint32_t task, std::uint32_t handle);
  void add_edge(std::uint32_t from, std::uint32_t to);

  std::vector<Task> tasks_;
  std::vector<TaskId> predecessors_;  ///< of task 0, of task 1, ...
  std::vector<std::uint32_t>
      last_target_;            ///< per task: the task its last edge leads to, so that no edge is stored twice
  std::vector<LastUse> last_;  ///< per handle
  std::vector<Reader> readers_;       ///< nodes of all reader lists
  std::vector<DataName> data_names_;  ///< one per call of data(), by first handle
};

/// Throws std::logic_error when an edge does not lead from an earlier to a later task or is stored twice: a
/// defect of Graph, not of its user. Cost: all edges once.
void validate(const Graph& graph);

}  // namespace talus::graph
