#pragma once

/// Report of a step that has been done.

#include <cstdint>
#include <optional>
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

/// Name of a step in messages.
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

/// Updates the report of the step before to this step. `elapsed`: time that the step took [s]. Collective.
void add_step(StepReport& report, const StepOutcome& outcome, const DeepestOverlap& overlap, double elapsed,
              const graph::Communicator& ranks);

/// Stresses and strains of the box that the walls close, after the step of `report`; none if they close none.
/// `strain`: of its lengths, since the stage began [1]. Collective.
std::optional<TriaxialReport> triaxial_report(const StepOutcome& outcome, const StepReport& report,
                                              const Stage& stage, const Vec3& strain,
                                              const graph::Communicator& ranks);

/// The largest impulse by which attraction holds a grain of mean size at a wall in a step [N s]; 0 without
/// any.
double cohesive_impulse(const StepOutcome& outcome);

/// Time in which the sample would fall by a mean diameter d, were its load all that moves it [s]:
/// sqrt(2 d m / load). Load is the weight plus the sum of the forces on pushed walls; under gravity alone
/// that is the free fall of a grain. 0 without a load.
double fall_time(const StepOutcome& outcome);

/// Fewest contacts that hold a grain still: 2 with friction; 4 without, one of which weight can replace.
std::int32_t contacts_to_hold(const StepParameters& parameters);

}  // namespace talus
