/// What a trace needs to know of a step's tasks and of its loop.

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "runtime/step/loop_nodes.hpp"
#include "runtime/step/step_graph.hpp"
#include "runtime/step/task_kinds.hpp"
#include "runtime/trace/order.hpp"
#include "runtime/trace/task_times.hpp"

namespace talus {

namespace {

trace::Kind kind_of_task(std::string_view name, bool team) {
  using enum TaskKind;
  static constexpr std::pair<std::string_view, TaskKind> kinds[] = {
      {"predict", predict}, {"cells", cells},   {"pairs", pairs}, {"chunks", chunks},  {"narrow", narrow},
      {"plan", plan},       {"finish", finish}, {"walls", walls}, {"measure", report}, {"sum", sum}};
  const std::string_view base = name.substr(0, name.find('['));
  for (const auto& [known, kind] : kinds)
    if (base == known) return kind_of(kind);
  if (!team) throw std::logic_error(fmt::format("task '{}' has no kind for traces", name));
  return trace::kind_team;
}

}  // namespace

std::vector<trace::Task> StepGraph::declared_tasks() const {
  std::vector<trace::Task> tasks;
  for (std::uint32_t i = 0; i < graph_.size(); ++i) {
    const graph::TaskId id{i};
    trace::Task& task = tasks.emplace_back();
    task.name = graph_.name(id);
    task.team = graph_.is_team(id);
    task.kind = kind_of_task(task.name, task.team);
    // Tracks are shares of the rank's cells and chunks, which stand by subdomain, or of one subdomain's
    // bodies.
    if (const std::size_t bracket = task.name.find('['); bracket != std::string::npos) {
      const std::uint32_t track = static_cast<std::uint32_t>(std::stoul(task.name.substr(bracket + 1)));
      task.group = state_.decomposition.here[SubdomainPlace(track / shares_per_subdomain_)].value();
    }
    for (graph::TaskId before : graph_.predecessors(id))
      task.predecessors.push_back(static_cast<std::uint32_t>(before));
  }
  return tasks;
}

trace::Plan StepGraph::describe_plan(const graph::LoopPlan& loop) const {
  const Chunks& chunks = state_.chunks;
  trace::Plan plan;
  plan.colour = loop.colour;
  plan.offset = loop.offset;
  plan.neighbour = loop.neighbour;
  plan.owner = loop.owner;
  for (std::size_t n = 0; n < loop.nodes.size(); ++n) {
    const auto [role, group] = loop.nodes[n];
    const bool chunk = role == graph::LoopRole::work, none = group == graph::LoopPlan::none;
    plan.role.push_back(static_cast<std::uint8_t>(trace::role_of(role)));
    plan.group.push_back(
        none ? trace::root_group
             : static_cast<std::uint32_t>(state_.decomposition.here[SubdomainPlace(group)].value()));
    plan.weight.push_back(chunk ? work_of_chunk(state_, n) : 0);
    plan.place.push_back(
        chunk  ? place_of_chunk(chunks, n)
        : none ? 0
               : static_cast<std::uint32_t>(loop_.gluing().subdomain_colour(SubdomainPlace(group))));
  }
  plan.messages = loop_.gluing().message_plan();
  return plan;
}

void StepGraph::note_plan(const graph::LoopPlan& loop) {
  trace::Plan plan = describe_plan(loop);
  if (order_) order_->plan(plan);
  if (executor_.times()) executor_.times()->plan(plan);
  if (executor_.trace()) executor_.trace()->plan(std::move(plan));
}

/// Without a trace or a recorded order the loop runs the program itself, so that neither costs anything then.
void StepGraph::iterate(graph::Worker& worker) {
  trace::Recorder* const trace =
      executor_.trace() && executor_.trace()->active() ? executor_.trace() : nullptr;
  const auto run = [&](auto& program) {
    if (!trace) {
      graph::run_epochs(epochs_, worker, program);
      return;
    }
    trace::Traced traced(program, *trace, worker.thread());
    graph::run_epochs(epochs_, worker, traced);
  };
  if (const trace::TaskTimes* const times = executor_.times(); times && times->active()) {
    trace::Timed timed(loop_, *times);
    return run(timed);
  }
  if (!followed_) return run(loop_);
  trace::Ordered ordered(loop_, *order_, worker);
  run(ordered);
}

void StepGraph::follow(trace::Order* order) {
  if (order && (order->threads() != executor_.threads() || order->ranks() != ranks_.ranks()))
    throw std::invalid_argument(
        fmt::format("the order was recorded on {} ranks x {} threads and cannot be followed on {} x {}",
                    order->ranks(), order->threads(), ranks_.ranks(), executor_.threads()));
  order_ = order;
}

}  // namespace talus
