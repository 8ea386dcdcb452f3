#include "runtime/graph/graph.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace talus::graph {

Handle Graph::data(std::string name) {
  const Handles handles{Handle{static_cast<std::uint32_t>(last_.size())}, 1};
  last_.emplace_back();
  data_names_.push_back({std::move(name), handles, false});
  return handles.first;
}

Handles Graph::data(std::string name, std::uint32_t count) {
  const Handles handles{Handle{static_cast<std::uint32_t>(last_.size())}, count};
  last_.resize(last_.size() + count);
  if (count > 0) data_names_.push_back({std::move(name), handles, true});
  return handles;
}

TaskId Graph::task(std::string name, const std::vector<Access>& accesses, std::function<void()> work) {
  if (!work) throw std::invalid_argument("task '" + name + "' has no work");
  return add({std::move(name), std::move(work), {}, 0}, accesses);
}

TaskId Graph::team(std::string name, const std::vector<Access>& accesses, std::function<void(Worker&)> work) {
  if (!work) throw std::invalid_argument("team task '" + name + "' has no work");
  return add({std::move(name), {}, std::move(work), 0}, accesses);
}

TaskId Graph::add(Task task, const std::vector<Access>& accesses) {
  for (const Access& access : accesses) {
    const std::size_t end = static_cast<std::size_t>(access.handles.first) + access.handles.count;
    if (end > last_.size())
      throw std::invalid_argument("task '" + task.name + "' accesses handle " + std::to_string(end - 1) +
                                  ", but the graph has only " + std::to_string(last_.size()) +
                                  ": take handles from Graph::data, again after clear()");
  }
  const auto id = static_cast<std::uint32_t>(tasks_.size());
  task.first_predecessor = predecessors_.size();
  tasks_.push_back(std::move(task));
  last_target_.push_back(none);
  for (const Access& access : accesses) {
    const auto first = static_cast<std::uint32_t>(access.handles.first);
    for (std::uint32_t handle = first; handle < first + access.handles.count; ++handle)
      access.writes ? add_write(id, handle) : add_read(id, handle);
  }
  std::sort(predecessors_.begin() + static_cast<std::ptrdiff_t>(tasks_.back().first_predecessor),
            predecessors_.end());
  return TaskId{id};
}

void Graph::add_read(std::uint32_t task, std::uint32_t handle) {
  LastUse& last = last_[handle];
  add_edge(last.writer, task);
  readers_.push_back({task, last.readers});
  last.readers = static_cast<std::uint32_t>(readers_.size() - 1);
}

void Graph::add_write(std::uint32_t task, std::uint32_t handle) {
  LastUse& last = last_[handle];
  add_edge(last.writer, task);
  for (std::uint32_t reader = last.readers; reader != none; reader = readers_[reader].next)
    add_edge(readers_[reader].task, task);
  last = {task, none};
}

void Graph::add_edge(std::uint32_t from, std::uint32_t to) {
  if (from == none || from == to || last_target_[from] == to) return;
  last_target_[from] = to;
  predecessors_.push_back(TaskId{from});
}

void Graph::clear() noexcept {
  tasks_.clear();
  predecessors_.clear();
  last_target_.clear();
  last_.clear();
  readers_.clear();
  data_names_.clear();
}

std::string Graph::name(Handle handle) const {
  const auto number = static_cast<std::uint32_t>(handle);
  if (number >= last_.size()) throw std::out_of_range("the graph has no handle " + std::to_string(number));
  const auto after =
      std::upper_bound(data_names_.begin(), data_names_.end(), handle,
                       [](Handle h, const DataName& entry) { return h < entry.handles.first; });
  const DataName& entry = *std::prev(after);
  if (!entry.range) return entry.name;
  return entry.name + "[" + std::to_string(number - static_cast<std::uint32_t>(entry.handles.first)) + "]";
}

std::span<const TaskId> Graph::predecessors(TaskId task) const {
  const std::size_t begin = at(task).first_predecessor;
  const auto next = static_cast<std::size_t>(task) + 1;
  const std::size_t end = next < tasks_.size() ? tasks_[next].first_predecessor : predecessors_.size();
  return std::span(predecessors_).subspan(begin, end - begin);
}

void validate(const Graph& graph) {
  for (std::uint32_t i = 0; i < graph.size(); ++i) {
    const auto before = graph.predecessors(TaskId{i});
    const bool rising =
        std::adjacent_find(before.begin(), before.end(), std::greater_equal<>{}) == before.end();
    if (!rising || (!before.empty() && before.back() >= TaskId{i}))
      throw std::logic_error("task " + std::to_string(i) + " '" + graph.name(TaskId{i}) +
                             "': predecessors are not distinct earlier tasks");
  }
}

}  // namespace talus::graph
