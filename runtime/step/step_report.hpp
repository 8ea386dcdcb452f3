#pragma once

/// What is said of a step that has been done.

#include <cstdint>
#include <string>
#include <string_view>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/certificate.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"
#include "runtime/step/step_graph.hpp"

namespace talus {

/// How messages call a step.
struct StepName {
  std::int64_t number;     ///< from 1
  std::string_view stage;  ///< name
  std::string text() const;
};

/// What a step is judged by: what it was given, and what it did.
struct StepOutcome {
  StepName step;
  const Setup& setup;
  const SampleSize& sample;
  const StepParameters& parameters;
  const StepState& state;
  const StepSums& sums;
  const IterationResult& result;
};

/// From the report of the step before to that of this one. `elapsed`: time that the step took [s].
void add_step(StepReport& report, const StepOutcome& outcome, double elapsed);

/// Distance from rest: the larger of net force over load (walls, sample) and kinetic energy over load x
/// grain diameter. `report`: of the step.
double unrest(const StepOutcome& outcome, const StepReport& report);

/// Mean number of active contacts of the grains that are no rattlers: those with fewer than 4 without
/// friction, 2 with it (a frictionless grain cannot be held by three). Collective.
double coordination(const StepState& state, const graph::Communicator& ranks, bool friction);

}  // namespace talus
