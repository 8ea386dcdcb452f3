#pragma once

/// What a stage loads a periodic cell with.

#include <span>

#include "runtime/step/cell_flow.hpp"
#include "runtime/step/step_report.hpp"

namespace talus {

/// Where in the run a step stands.
struct StageMoment {
  std::size_t stage = 0;                      ///< index
  double time = 0;                            ///< since the stage began [s]
  std::span<const double> stage_begins = {};  ///< times of the run at which the stages up to it began [s]
};

/// The stress that each component aims at [Pa]; 0 where the stage prescribes the flow.
CellVelocity stress_aimed_at(const Setup& setup, const StageMoment& at);

/// Which components follow a stress in the stage, and the mass of the cell: `cell_inertia` times that of all
/// grains, its length their mean diameter.
void prescribe_cell(const Setup& setup, const Stage& stage, const SampleSize& size, StressedCell& cell);

/// What drives the cell in the coming step, of which state.cell.push is made. Collective where a stress does.
CellDrive drive_cell(const Setup& setup, const StageMoment& at, const StepParameters& parameters,
                     StepState& state, const graph::Communicator& ranks);

}  // namespace talus
