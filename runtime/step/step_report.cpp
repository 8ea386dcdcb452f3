#include "runtime/step/step_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "kernels/bodies/larger.hpp"
#include "kernels/detection/domain.hpp"

namespace talus {

std::string StepName::text() const {
  return fmt::format("step {} (stage '{}')", number, stage);
}

void add_step(StepReport& report, const StepOutcome& outcome, double elapsed) {
  const auto& [step, setup, sample, parameters, state, sums, result] = outcome;
  // Grains at rest between pressed walls gain nothing, and what the walls give cancels: the walls' impulses
  // are the measure then.
  double impulse_unit = std::max(sums.motion.impulse_scale, std::numeric_limits<double>::min());
  Vec3 from_walls = Vec3::Zero();
  for (const WallState& wall : state.wall_states) {
    from_walls += wall.impulse;
    impulse_unit = std::max(impulse_unit, wall.impulse.norm());
  }
  // What rounding leaves of the sample's momentum, at most sqrt(2 E M), is no defect.
  const double energy = sums.motion.energy.translation + sums.motion.energy.rotation;
  impulse_unit = std::max(impulse_unit, 1e-12 * std::sqrt(2 * energy * sample.total_mass));
  const double defect = (sums.motion.impulse - from_walls).norm() / impulse_unit;
  report.step = step.number;
  report.time += parameters.time_step;
  report.candidates = sums.candidates;
  report.contacts = result.contacts;
  report.active = result.active;
  report.iterations = result.iterations;
  report.error_rms = result.error_rms;
  report.error_max = result.error_max;
  report.balance = larger(result.unbalance, defect);
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
  report.kinetic_translation = sums.motion.energy.translation;
  report.kinetic_rotation = sums.motion.energy.rotation;
  const double box = Domain{}.volume(state.walls);
  report.solid_fraction = box > 0 ? sample.volume / box : 0;
  report.wall_s = elapsed;
  report.converged = certified(result, defect, report.passed, setup.solver);
}

double unrest(const StepOutcome& outcome, const StepReport& report) {
  const auto& [step, setup, sample, parameters, state, sums, result] = outcome;
  const double h = parameters.impulse_time();
  double load = sample.total_mass * parameters.gravity.norm(), net = 0;
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    const double applied = state.wall_states[w].applied;
    if (applied == 0) continue;
    load += std::abs(applied);
    net = std::max(net, std::abs(state.wall_states[w].impulse.dot(state.walls[w].normal) / h - applied) /
                            std::abs(applied));
  }
  const double energy = report.kinetic_translation + report.kinetic_rotation;
  if (load == 0) return energy > 0 ? std::numeric_limits<double>::infinity() : 0;
  const Vec3 gained = sums.motion.impulse / h + sample.total_mass * parameters.gravity;
  return std::max({net, gained.norm() / load, energy / (load * sample.mean_diameter)});
}

double coordination(const StepState& state, const graph::Communicator& ranks, bool friction) {
  const std::int32_t rattler_below = friction ? 2 : 4;
  std::vector<std::int32_t> touching = count_active(state.contacts, state.chunks, state.bodies.size());
  const Decomposition& all = state.decomposition;
  if (all.several()) {
    struct Part {
      std::int64_t id, count;
    };
    std::vector<Part> parts;  // of bodies whose contacts are spread over subdomains
    for (std::size_t s = 0; s < touching.size(); ++s)
      if (all.multiplicity[s] > 1)
        parts.push_back({static_cast<std::int64_t>(state.bodies.id[s]), touching[s]});
    parts = ranks.gather_records(std::span<const Part>(parts));
    std::unordered_map<std::int64_t, std::int32_t> whole;
    for (const Part& part : parts) whole[part.id] += static_cast<std::int32_t>(part.count);
    for (std::size_t s = 0; s < touching.size(); ++s)
      if (all.multiplicity[s] > 1) touching[s] = whole[static_cast<std::int64_t>(state.bodies.id[s])];
  }
  std::int64_t sums[2] = {0, 0};
  for (std::size_t s = 0; s < touching.size(); ++s) {
    if (touching[s] < rattler_below || (!all.counts.empty() && !all.counts[s])) continue;
    ++sums[0];
    sums[1] += touching[s];
  }
  ranks.sum(sums);
  return sums[0] > 0 ? static_cast<double>(sums[1]) / static_cast<double>(sums[0]) : 0;
}

}  // namespace talus
