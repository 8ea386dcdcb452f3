#include "runtime/step/step_graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "kernels/bodies/release.hpp"
#include "runtime/graph/clock.hpp"
#include "runtime/trace/task_times.hpp"

namespace talus {

/// Enough shares for the threads of any machine, few enough that a task stays coarse.
std::uint32_t StepGraph::shares_for(std::int64_t bodies, std::int32_t subdomains) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(bodies / std::max(1, subdomains) / 512, 1, 64));
}

StepGraph::StepGraph(StepState& state, const StepParameters& parameters, const Setup& setup,
                     std::uint32_t shares, graph::Executor& executor, const graph::Communicator& ranks)
    : state_(state),
      parameters_(parameters),
      setup_(setup),
      settings_(setup.solver),
      decomposition_(setup.decomposition),
      executor_(executor),
      ranks_(ranks),
      shares_per_subdomain_(shares),
      shares_(shares_per_subdomain_ * static_cast<std::uint32_t>(state.decomposition.here.size())),
      loop_(state, parameters, setup.solver, setup.decomposition, ranks),
      left_(shares_),
      pairs_(shares_),
      motion_(shares_),
      beyond_reach_(shares_) {
  build();
}

void StepGraph::build() {
  using graph::read;
  using graph::write;
  const auto bodies = graph_.data("bodies", shares_);
  const auto cells = graph_.data("cells");
  const auto pairs = graph_.data("pairs", shares_);
  const auto chunks = graph_.data("chunks");
  const auto contacts = graph_.data("contacts", shares_);
  const auto loop = graph_.data("loop");
  for (std::uint32_t share = 0; share < shares_; ++share)
    graph_.task(fmt::format("predict[{}]", share), {write(bodies[share])},
                [this, share] { predict_share(share); });
  graph_.task("cells", {read(bodies), write(cells)}, [this] { make_cells(); });
  for (std::uint32_t share = 0; share < shares_; ++share)
    graph_.task(fmt::format("pairs[{}]", share), {read(cells), write(pairs[share])},
                [this, share] { find_pairs_of_share(share); });
  graph_.task("chunks", {read(cells), read(pairs), write(chunks)}, [this] { make_chunks(); });
  for (std::uint32_t share = 0; share < shares_; ++share)
    graph_.task(fmt::format("narrow[{}]", share), {read(chunks), read(bodies), write(contacts[share])},
                [this, share] { narrow_share(share); });
  graph_.task("plan", {read(contacts), write(loop)}, [this] { plan_iteration(); });
  graph_.team("iterate", {write(loop), write(bodies), write(contacts)},
              [this](graph::Worker& worker) { iterate(worker); });
  for (std::uint32_t share = 0; share < shares_; ++share)
    graph_.task(fmt::format("finish[{}]", share), {read(loop), write(bodies[share])},
                [this, share] { finish_share(share); });
  const auto walls = graph_.data("walls");
  graph_.task("walls", {read(loop), write(walls)}, [this] { finish_walls(); });
  for (std::uint32_t share = 0; share < shares_; ++share)
    graph_.task(fmt::format("measure[{}]", share), {read(bodies), read(walls), write(contacts[share])},
                [this, share] { measure_share(share); });
  graph_.task("sum", {read(bodies), read(contacts)}, [this] { sum_up(); });
  if (executor_.trace()) executor_.trace()->declare(declared_tasks());
  if (executor_.times()) executor_.times()->check(declared_tasks());
}

void StepGraph::release_room() {
  loop_.release_room();
  state_.free = {};
  release(state_.contacts.bias);
}

/// The room that release_room has given back, before tasks fill it in parts.
void StepGraph::take_room() {
  state_.free.u.resize(state_.bodies.size());
  state_.free.w.resize(parameters_.rotates ? state_.bodies.size() : 0);
  state_.contacts.bias.resize(state_.contacts.nx.size());
}

void StepGraph::run() {
  take_room();
  sums_ = {};
  ++steps_;
  // In a step whose times are given nothing else counts, not even the time to look them up.
  std::optional<graph::GivenTime> none;
  trace::TaskTimes* const times = executor_.times();
  if (times) {
    none.emplace(0);
    if (!times->begin_step(static_cast<std::uint32_t>(steps_))) none.reset();
  }
  started_ = graph::seconds_now();
  trace::Recorder* const trace = executor_.trace();
  if (trace) trace->begin_step(static_cast<std::uint32_t>(steps_));
  executor_.run(graph_);
  if (trace) trace->end_step();
  if (times) times->end_step();
}

}  // namespace talus
