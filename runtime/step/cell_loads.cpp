#include "runtime/step/cell_loads.hpp"

#include <cmath>
#include <numbers>

#include "runtime/step/cell_report.hpp"

namespace talus {

namespace {

/// The stage before ended when this one began, perhaps within its own ramp.
StageMoment end_of_stage_before(const StageMoment& at) {
  return {at.stage - 1, at.stage_begins[at.stage] - at.stage_begins[at.stage - 1], at.stage_begins};
}

double aim(const Setup& setup, const StageMoment& at, std::size_t k) {
  const StressLoad& load = setup.stages[at.stage].stress;
  if (!load.to[k]) return 0;
  double reached = *load.to[k];
  if (at.time < load.ramp_time) {
    const double from = at.stage > 0 ? aim(setup, end_of_stage_before(at), k) : setup.stress_at_start[k];
    reached = from + (reached - from) * (at.time / load.ramp_time);
  }
  const double swing = load.period > 0 ? std::sin(2 * std::numbers::pi * at.time / load.period) : 0;
  return reached + load.amplitude[k] * swing;
}

}  // namespace

CellVelocity stress_aimed_at(const Setup& setup, const StageMoment& at) {
  CellVelocity stress{};
  for (std::size_t k = 0; k < cell_freedoms; ++k) stress[k] = aim(setup, at, k);
  return stress;
}

void prescribe_cell(const Setup& setup, const Stage& stage, const SampleSize& size, StressedCell& cell) {
  for (std::size_t k = 0; k < cell_freedoms; ++k) cell.follows[k] = stage.stress.to[k].has_value();
  cell.mass = setup.cell_inertia * size.total_mass;
  cell.length = size.mean_diameter;
  cell.grains = size.bodies;
}

CellDrive drive_cell(const Setup& setup, const StageMoment& at, const StepParameters& parameters,
                     StepState& state, const graph::Communicator& ranks) {
  CellDrive drive{.gradient = parameters.velocity_gradient};
  StressedCell& cell = state.cell;
  if (!cell.loaded()) return drive;
  CellVelocity gain{};
  // In the middle of the step, as the edges are.
  cell.aim = stress_aimed_at(setup, {at.stage, at.time + 0.5 * parameters.time_step, at.stage_begins});
  const CellVelocity kinetic = components_of(kinetic_moment(state, gradient_before(state.domain, 0), ranks));
  const double volume = state.domain.volume(state.walls);
  for (std::size_t k = 0; k < cell_freedoms; ++k) {
    cell.push[k] =
        cell.follows[k] ? parameters.impulse_time() * (kinetic[k] - volume * cell.aim[k]) / cell.length : 0;
    gain[k] = cell.push[k] / (cell.mass * cell.length);
  }
  drive.follows = cell.followed();
  drive.gain = gradient_of(gain, 1);
  return drive;
}

}  // namespace talus
