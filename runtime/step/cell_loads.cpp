#include "runtime/step/cell_loads.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "runtime/step/cell_report.hpp"

namespace talus {

namespace {

/// When a stage ends that the run has left: nobody asks before.
constexpr double ended = std::numeric_limits<double>::infinity();

double aim(const Setup& setup, const StageMoment& at, std::size_t k) {
  const StressLoad& load = setup.stages[at.stage].stress;
  if (!load.to[k]) return 0;
  const double to = *load.to[k];
  double from = to;
  if (load.ramp_time > 0 && at.time < load.ramp_time)
    from = at.stage > 0 ? aim(setup, {at.stage - 1, ended}, k) : 0;
  const double part = load.ramp_time > 0 ? std::min(1.0, at.time / load.ramp_time) : 1;
  const double swing =
      load.period > 0 && std::isfinite(at.time) ? std::sin(2 * std::numbers::pi * at.time / load.period) : 0;
  return from + (to - from) * part + load.amplitude[k] * swing;
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
  cell.aim = stress_aimed_at(setup, {at.stage, at.time + 0.5 * parameters.time_step});
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
