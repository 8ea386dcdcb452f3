#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/graph/executor.hpp"
#include "runtime/graph/graph.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/iteration.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// The state blew up: NaN, or energy that no load supplied. The message has the step, the body and its state.
class RunawayError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Where a step's time went [s], summed over its tasks' threads' wall clock.
struct StepTimes {
  double detection = 0;  ///< predict, broad and narrow phase, chunks
  double iteration = 0;
  double rest = 0;
};

/// A simulation on one process: stages of time steps, each step one graph of tasks (docs/theory.md, "One time step").
///
///   Executor executor({.threads = 2});
///   Simulation simulation(setup, std::move(bodies), executor);
///   while (!simulation.finished()) {
///     const StepReport& report = simulation.step();
///     if (wanted(report.step)) executor.submit_background("output", [frame = simulation.frame()] { write(frame); });
///   }
///
/// The graph of a step, its tasks cut into lanes that depend on the number of bodies alone, never on threads:
///   loads -> predict[lane] -> broad: cells -> pairs[lane] -> chunks -> narrow[lane] -> plan -> iterate (team) -> finish[lane] -> report
/// `broad` tasks return at once while every grain is within its margin. Results do not depend on the number of threads.
class Simulation {
 public:
  /// Throws std::invalid_argument when the setup makes no sense. Bodies are sorted in Morton order. The executor must outlive the simulation.
  Simulation(Setup setup, Bodies bodies, graph::Executor& executor);
  ~Simulation();

  /// Does one time step. Throws RunawayError, or graph::TaskError when a task failed. Not to be called when finished.
  const StepReport& step();

  bool finished() const;
  /// Part of the current stage that is done, in [0, 1], by its nearest end condition.
  double stage_fraction() const;
  const Stage& stage() const;
  std::size_t stage_index() const;
  std::int64_t steps_of_stage() const;

  const Setup& setup() const;
  const StepState& state() const;
  const StepParameters& parameters() const;
  const std::vector<Iteration::Check>& error_history() const;
  const StepReport& report() const;
  const StepTimes& times() const;

  /// Walls after the last step: positions, velocities, forces.
  std::vector<WallReport> walls() const;
  /// Strains and stresses after the last step; empty when the walls do not close a box.
  std::optional<TriaxialReport> triaxial() const;
  /// A copy of what output needs; contacts with r_n > 0 only, `contacts` false leaves them out.
  Frame frame(bool contacts = true) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> impl_;
};

}  // namespace talus
