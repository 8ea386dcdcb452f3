#include "runtime/step/step_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernels/bodies/larger.hpp"
#include "runtime/step/cell_flow.hpp"
#include "runtime/step/cell_report.hpp"
#include "runtime/step/coordination.hpp"

namespace talus {

std::string StepName::text() const {
  return fmt::format("step {} (stage '{}')", number, stage);
}

namespace {

double load_of(const StepOutcome& outcome) {
  double load = outcome.sample.total_mass * outcome.parameters.gravity.norm();
  for (const WallState& wall : outcome.state.wall_states) load += std::abs(wall.applied);
  const StressedCell& cell = outcome.state.cell;
  if (!cell.loaded()) return load;
  const Vec3 lengths = outcome.state.domain.lengths(outcome.state.walls);
  for (const Eigen::Index k : {0, 1, 2})
    if (const auto at = static_cast<std::size_t>(k); cell.follows[at])
      load += std::abs(cell.aim[at]) * lengths.prod() / lengths[k];
  return load;
}

/// StepReport::equilibrium. Where nothing but a cell bounds the sample its motion is that against the flow
/// and against the mean: a sample that drifts or is sheared evenly is none the less at rest.
double distance_from_equilibrium(const StepOutcome& outcome, const std::optional<Mat3>& against_flow) {
  const auto& [step, setup, sample, parameters, state, sums, result] = outcome;
  // Where no grain is left there is nothing to rest.
  if (!(sample.total_mass > 0)) return std::numeric_limits<double>::infinity();
  const double h = parameters.impulse_time(), load = load_of(outcome);
  double net = 0;
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    const double applied = state.wall_states[w].applied;
    if (applied == 0) continue;
    net = std::max(net, std::abs(state.wall_states[w].impulse.dot(state.walls[w].normal) / h - applied) /
                            std::abs(applied));
  }
  // Of a cell against its own push, or a tenth of the largest where it aims at little; shears against the
  // largest.
  constexpr double little = 0.1;
  double largest = 0;
  for (const double push : state.cell.push) largest = std::max(largest, std::abs(push));
  for (std::size_t k = 0; k < cell_freedoms; ++k)
    if (const double unit = k < 3 ? std::max(std::abs(state.cell.push[k]), little * largest) : largest;
        state.cell.follows[k] && unit > 0)
      net = std::max(net, std::abs(state.cell.impulse[k] + state.cell.push[k]) / unit);
  const double translation = against_flow ? 0.5 * against_flow->trace() : sums.motion.energy.translation;
  const double energy = translation + sums.motion.energy.rotation;
  if (load == 0) return energy > 0 ? std::numeric_limits<double>::infinity() : 0;
  const Vec3 gained = sums.motion.impulse / h + sample.total_mass * parameters.gravity;
  return std::max({net, gained.norm() / load, energy / (load * sample.mean_diameter)});
}

}  // namespace

double cohesive_impulse(const StepOutcome& outcome) {
  const TouchingRadii radii{0.5 * outcome.sample.mean_diameter, std::numeric_limits<double>::infinity()};
  double cohesion = 0;
  for (const PairLaw& law : outcome.parameters.laws.laws())
    cohesion = std::max(cohesion, law.cohesion_of(radii));
  return cohesion * outcome.parameters.impulse_time();
}

double fall_time(const StepOutcome& outcome) {
  const double load = load_of(outcome);
  return load > 0 ? std::sqrt(2 * outcome.sample.mean_diameter * outcome.sample.total_mass / load) : 0;
}

void add_step(StepReport& report, const StepOutcome& outcome, const DeepestOverlap& overlap, double elapsed,
              const graph::Communicator& ranks) {
  const auto& [step, setup, sample, parameters, state, sums, result] = outcome;
  // Grains at rest between pressed walls gain nothing, and what the walls give cancels: the walls' impulses
  // are the measure then.
  double impulse_unit = std::max(sums.motion.impulse_scale, std::numeric_limits<double>::min());
  Vec3 from_walls = Vec3::Zero();
  for (const WallState& wall : state.wall_states) {
    from_walls += wall.impulse;
    impulse_unit = std::max(impulse_unit, wall.impulse.norm());
  }
  // The faces of a cell carry forces as walls would.
  if (const StressedCell& cell = state.cell; cell.loaded())
    impulse_unit = std::max(impulse_unit, Eigen::Map<const Vec3>(cell.impulse.data()).norm() * cell.length /
                                              state.domain.mean_edge());
  // What rounding leaves of the sample's momentum, at most sqrt(2 E M), is no defect.
  const double energy = sums.motion.energy.translation + sums.motion.energy.rotation;
  impulse_unit = std::max(impulse_unit, 1e-12 * std::sqrt(2 * energy * sample.total_mass));
  // Nor what it leaves of pulls and pushes that cancel.
  impulse_unit = std::max(impulse_unit, 1e-12 * std::sqrt(sample.bodies) * cohesive_impulse(outcome));
  const double defect = (sums.motion.impulse - from_walls).norm() / impulse_unit;
  report.step = step.number;
  report.time += parameters.time_step;
  report.time_step = parameters.time_step;
  report.candidates = sums.candidates;
  report.contacts = result.contacts;
  report.active = result.active;
  report.iterations = result.iterations;
  report.error_rms = result.error_rms;
  report.error_max = result.error_max;
  report.error_quantile = result.error_quantile;
  report.worst = result.worst;
  report.balance = larger(result.unbalance, defect);
  report.velocity_error = result.velocity_claim;
  report.jump = result.jump;
  report.migrants = sums.migrants;
  report.imbalance = 1 + state.decomposition.imbalance;
  report.penetration_mean =
      sums.contacts.overlapping > 0
          ? sums.contacts.penetration / static_cast<double>(sums.contacts.overlapping) / sample.smallest
          : 0;
  report.penetration_max =
      sums.contacts.penetration_max > 0 ? sums.contacts.penetration_max / sample.smallest : 0;
  report.passed = sums.contacts.passed;
  report.overlap = overlap.depth;
  report.overlapping = overlap.named ? std::optional(overlap.pair) : std::nullopt;
  report.kinetic_translation = sums.motion.energy.translation;
  report.kinetic_rotation = sums.motion.energy.rotation;
  const double box = state.domain.volume(state.walls);
  report.solid_fraction = box > 0 ? sample.volume / box : 0;
  report.kinetic_moment.reset();
  if (state.domain.edges().minCoeff() > 0 && load_of(outcome) > 0)
    report.kinetic_moment = kinetic_moment(state, gradient_before(state.domain, 0), ranks);
  report.equilibrium = distance_from_equilibrium(outcome, report.kinetic_moment);
  report.wall_s = elapsed;
  report.converged = certified(result, defect, report.passed, report.overlap, setup.solver);
}

std::int32_t contacts_to_hold(const StepParameters& parameters) {
  if (parameters.friction) return 2;
  return parameters.gravity.norm() > 0 ? 3 : 4;
}

std::optional<TriaxialReport> triaxial_report(const StepOutcome& outcome, const StepReport& report,
                                              const Stage& stage, const Vec3& strain,
                                              const graph::Communicator& ranks) {
  const double box = outcome.state.domain.volume(outcome.state.walls);
  if (!(box > 0)) return std::nullopt;
  TriaxialReport out;
  out.step = report.step;
  out.time = report.time;
  out.stage = stage.name;
  out.solid_fraction = report.solid_fraction;
  const Eigen::Matrix3d stress = outcome.sums.contacts.moment / (box * outcome.parameters.impulse_time());
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    out.strain[a] = strain[axis];
    out.strain_volume += out.strain[a];
    out.stress[a] = stress(axis, axis);
    out.p += out.stress[a] / 3;
  }
  const auto axial = static_cast<std::size_t>(stage.end.strain_axis);
  const std::size_t first = (axial + 1) % 3, second = (axial + 2) % 3;
  out.strain_shear = out.strain[axial] - 0.5 * (out.strain[first] + out.strain[second]);
  out.q = out.stress[axial] - 0.5 * (out.stress[first] + out.stress[second]);
  out.q_over_p = out.p > 0 ? out.q / out.p : 0;
  out.coordination = coordination(outcome.state, ranks, contacts_to_hold(outcome.parameters));
  out.converged = report.converged;
  return out;
}

}  // namespace talus
