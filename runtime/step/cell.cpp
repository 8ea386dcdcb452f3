#include "runtime/step/cell.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace talus {

namespace {

/// Rates of a stage along and between axes that repeat, small enough for its time step.
void validate_flow(const Setup& setup, const Stage& stage) {
  if (!stage.flows()) return;
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(fmt::format("stage '{}': {}", stage.name, what));
  };
  const Vec3 edges = setup.domain.edges();
  if (!stage.strain_rates.allFinite() || !stage.shear_rates.allFinite())
    refuse("strain_rates and shear_rates must be finite [1/s]");
  constexpr Eigen::Index pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (const Eigen::Index k : {0, 1, 2}) {
    if (stage.strain_rates[k] != 0 && edges[k] == 0)
      refuse(fmt::format("strain_rates along {}, where nothing is periodic: give cell.lengths", "xyz"[k]));
    if (stage.shear_rates[k] != 0 && (edges[pairs[k][0]] == 0 || edges[pairs[k][1]] == 0))
      refuse(fmt::format("shear_rates between {} and {}, which are not both periodic", "xyz"[pairs[k][0]],
                         "xyz"[pairs[k][1]]));
  }
  constexpr double most = 0.1;  // strain of a step
  const double step = stage.chooses_time_step ? stage.time_step_max : stage.time_step;
  if (step * std::max(stage.strain_rates.cwiseAbs().maxCoeff(), stage.shear_rates.cwiseAbs().maxCoeff()) >
      most)
    refuse(fmt::format("the cell is strained by more than {} in a step; make the time step shorter", most));
}

}  // namespace

void validate_cell(const Setup& setup) {
  for (const Stage& stage : setup.stages) validate_flow(setup, stage);
  if (!setup.domain.repeats) return;
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("cell: " + what); };
  for (const Wall& wall : setup.walls) {
    if (wall.surface() != nullptr)
      refuse(fmt::format("wall '{}' is no plane; a periodic cell has planes along its walled axes only",
                         wall.name));
    for (const Eigen::Index axis : {0, 1, 2})
      if (setup.domain.edges()[axis] > 0 && wall.normal[axis] != 0)
        refuse(
            fmt::format("wall '{}' bounds the sample along {}, where the cell is periodic; remove the "
                        "wall, or set cell.lengths[{}] to 0",
                        wall.name, "xyz"[axis], axis));
    if (std::ranges::any_of(wall.motion, &MotionPart::turns))
      refuse(fmt::format("wall '{}' turns; walls of a periodic cell keep their normals", wall.name));
  }
  if (!setup.inserts.empty() || !setup.removes.empty())
    refuse("grains cannot come or go in a periodic cell; remove [[insert]] and [[remove]]");
  if (!setup.probes.empty() || !setup.fields.empty())
    refuse("regions and grids know no images; remove [[probe]] and [[field]] (cell.csv has means)");
}

double candidate_margin(const DetectionSettings& detection, double smallest) {
  return alert_distance(detection, smallest) + skin_distance(detection, smallest);
}

void check_cell(const Domain& domain, double largest, double margin) {
  const double least = 2 * (2 * largest + margin);
  for (const Eigen::Index axis : {0, 1, 2}) {
    const double edge = domain.edges()[axis];
    if (edge > 0 && edge < least)
      throw std::invalid_argument(fmt::format(
          "cell: {} m along {} is less than {} m, twice the largest diameter and the distance at which "
          "contacts are looked for: a grain would touch two images of another. Make the cell larger, or the "
          "grains smaller",
          edge, "xyz"[axis], least));
  }
}

}  // namespace talus
