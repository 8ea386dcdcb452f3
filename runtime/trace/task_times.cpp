#include "runtime/trace/task_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "runtime/trace/replay.hpp"
#include "runtime/trace/timeline.hpp"

namespace talus::trace {
namespace {

constexpr double absent = -1;

/// Messages that take no time: what is left of a task is its work.
Machine without_network(int ranks) {
  Machine machine;
  machine.ranks = ranks;
  machine.latency = machine.overhead = machine.line = 0;
  machine.bandwidth = std::numeric_limits<double>::max();
  machine.quantile = 0.5;
  return machine;
}

}  // namespace

TaskTimes::TaskTimes(const Trace& recorded, int ranks, int rank) {
  Replay replayed = replay(Timeline(recorded), without_network(ranks), true);
  const Timeline played(replayed.trace);
  const auto own = static_cast<std::size_t>(rank);
  for (const std::uint32_t number : played.steps()) {
    const StepIndex index = played.index(number);
    const StepIndex::Rank& of = index.ranks[own];
    Step& step = steps_[number];
    if (of.plan) step.plan = *of.plan;
    for (std::size_t i = 0; i < of.task.size(); ++i)
      step.task.push_back(1e-9 * (played.self(of.task[i]) + played.self(of.part[i])));
    for (std::size_t e = 0; e < of.epochs; ++e) {
      std::vector<double>& nodes = step.node.emplace_back(of.nodes, absent);
      for (std::size_t n = 0; n < of.nodes; ++n)
        if (of.at(e, n).exists()) nodes[n] = 1e-9 * (played.self(of.at(e, n)) + replayed.dispatch);
      double decision = of.check[e].exists() ? 1e-9 * played.self(of.check[e]) : absent;
      decision += 1e-9 * played.self(of.alone[e]);
      for (const Place whole : of.whole[e]) decision += 1e-9 * played.self(whole);
      step.decision.push_back(decision);
    }
  }
  tasks_ = std::move(replayed.trace.tasks[own]);
}

bool TaskTimes::begin_step(std::uint32_t step) {
  const auto found = steps_.find(step);
  current_ = found == steps_.end() ? nullptr : &found->second;
  if (current_) match();
  return active();
}

void TaskTimes::check(const std::vector<Task>& tasks) const {
  const auto same = [](const Task& a, const Task& b) { return a.kind == b.kind && a.group == b.group; };
  if (!std::ranges::equal(tasks, tasks_, same))
    throw TraceError(
        "the steps of the trace have other tasks than those of the run: the scene or the subdomains differ");
}

void TaskTimes::plan(const Plan& plan) {
  plan_ = plan;
  if (current_) match();
}

/// The nodes of one subdomain have the same order in both.
void TaskTimes::match() {
  const auto order_of = [](const Plan& plan) {
    std::vector<std::uint32_t> order(plan.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, {},
                             [&](std::uint32_t n) { return std::pair(plan.role[n], plan.group[n]); });
    return order;
  };
  const Plan& recorded = current_->plan;
  const std::vector<std::uint32_t> here = order_of(plan_), there = order_of(recorded);
  place_.clear();
  if (here.size() != there.size()) return;
  for (std::size_t k = 0; k < here.size(); ++k)
    if (plan_.role[here[k]] != recorded.role[there[k]] || plan_.group[here[k]] != recorded.group[there[k]])
      return;
  place_.resize(here.size());
  for (std::size_t k = 0; k < here.size(); ++k) place_[here[k]] = there[k];
}

double TaskTimes::task(std::uint32_t id) const {
  return current_->task.at(id);
}

double TaskTimes::node(std::uint32_t node, int epoch) const {
  if (node >= place_.size())
    throw TraceError("the loop is another one than the recorded: the scene or the subdomains differ");
  const auto e = static_cast<std::size_t>(epoch);
  if (e >= current_->node.size() || current_->node[e][place_[node]] < 0)
    throw TraceError(
        fmt::format("the trace has no time for node {} in epoch {}; steps in which clusters were "
                    "put right, or ADMM was called, go other ways on several ranks",
                    node, epoch));
  return current_->node[e][place_[node]];
}

double TaskTimes::decision(int epoch) const {
  const auto e = static_cast<std::size_t>(epoch);
  if (e >= current_->decision.size() || current_->decision[e] < 0)
    throw TraceError(fmt::format("the trace has no time for a decision behind epoch {}", epoch));
  return current_->decision[e];
}

}  // namespace talus::trace
