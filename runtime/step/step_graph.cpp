#include "runtime/step/step_graph.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "runtime/graph/clock.hpp"
#include "runtime/trace/task_times.hpp"

namespace talus {

namespace {

/// Enough lanes for any node to share, few enough that a task stays coarse.
std::uint32_t lanes_for(std::size_t bodies) {
  return static_cast<std::uint32_t>(std::clamp<std::size_t>(bodies / 512, 1, 64));
}

}  // namespace

StepGraph::StepGraph(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
                     const DecompositionSettings& decomposition, std::int64_t bodies,
                     graph::Executor& executor, const graph::Communicator& ranks)
    : state_(state),
      parameters_(parameters),
      settings_(settings),
      decomposition_(decomposition),
      executor_(executor),
      ranks_(ranks),
      lanes_per_subdomain_(lanes_for(
          static_cast<std::size_t>(bodies / std::max(1, state.decomposition.partition.subdomains)))),
      lanes_(lanes_per_subdomain_ * static_cast<std::uint32_t>(state.decomposition.here.size())),
      iteration_(state, parameters, settings, decomposition, ranks),
      left_(lanes_),
      pairs_(lanes_),
      motion_(lanes_) {
  build();
}

void StepGraph::build() {
  using graph::read;
  using graph::write;
  const auto bodies = graph_.data("bodies", lanes_);
  const auto cells = graph_.data("cells");
  const auto pairs = graph_.data("pairs", lanes_);
  const auto chunks = graph_.data("chunks");
  const auto contacts = graph_.data("contacts", lanes_);
  const auto loop = graph_.data("loop");
  for (std::uint32_t lane = 0; lane < lanes_; ++lane)
    graph_.task(fmt::format("predict[{}]", lane), {write(bodies[lane])},
                [this, lane] { predict_lane(lane); });
  graph_.task("cells", {read(bodies), write(cells)}, [this] { make_cells(); });
  for (std::uint32_t lane = 0; lane < lanes_; ++lane)
    graph_.task(fmt::format("pairs[{}]", lane), {read(cells), write(pairs[lane])},
                [this, lane] { find_lane_pairs(lane); });
  graph_.task("chunks", {read(cells), read(pairs), write(chunks)}, [this] { make_chunks(); });
  for (std::uint32_t lane = 0; lane < lanes_; ++lane)
    graph_.task(fmt::format("narrow[{}]", lane), {read(chunks), read(bodies), write(contacts[lane])},
                [this, lane] { narrow_lane(lane); });
  graph_.task("plan", {read(contacts), write(loop)}, [this] { plan_iteration(); });
  graph_.team("iterate", {write(loop), write(bodies), write(contacts)},
              [this](graph::Worker& worker) { iterate(worker); });
  for (std::uint32_t lane = 0; lane < lanes_; ++lane)
    graph_.task(fmt::format("finish[{}]", lane), {read(loop), write(bodies[lane])},
                [this, lane] { finish_lane(lane); });
  const auto walls = graph_.data("walls");
  graph_.task("walls", {read(loop), write(walls)}, [this] { finish_walls(); });
  for (std::uint32_t lane = 0; lane < lanes_; ++lane)
    graph_.task(fmt::format("measure[{}]", lane), {read(bodies), read(walls), write(contacts[lane])},
                [this, lane] { measure_lane(lane); });
  graph_.task("sum", {read(bodies), read(contacts)}, [this] { sum_up(); });
  if (executor_.trace()) executor_.trace()->declare(declared_tasks());
  if (executor_.times()) executor_.times()->check(declared_tasks());
}

void StepGraph::run() {
  sums_ = {};
  ++steps_;
  // Nothing else counts in a step whose times are given, looking them up included.
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
