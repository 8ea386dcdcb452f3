#include "runtime/step/cell.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "kernels/fields/lucy.hpp"
#include "runtime/step/stressed_cell.hpp"
#include "runtime/step/time_step.hpp"

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
  // A stage that chooses its steps chooses them by the rates, too.
  if (strains_too_far(
          std::max(stage.strain_rates.cwiseAbs().maxCoeff(), stage.shear_rates.cwiseAbs().maxCoeff()),
          stage.shortest_step()))
    refuse(fmt::format("the cell is strained by more than {} in a step; make {} shorter",
                       TimeStepRule{}.longest_strain,
                       stage.chooses_time_step ? "time_step_min" : "the time step"));
}

/// Components that follow a stress: of a cell of spheres, between axes that repeat. Walls bound the others.
void validate_stress(const Setup& setup, const Stage& stage) {
  const StressLoad& load = stage.stress;
  const bool swings = std::ranges::any_of(load.amplitude, [](double a) { return a != 0; });
  if (!load.any() && !swings) return;
  const auto refuse_key = [&](const std::string& key, const std::string& what) {
    throw std::invalid_argument(
        fmt::format("stage '{}': stress{}: {}", stage.name, key.empty() ? "" : "." + key, what));
  };
  const auto refuse = [&](const std::string& what) { refuse_key("", what); };
  constexpr const char* names[] = {"xx", "yy", "zz", "xy", "xz", "yz"};
  constexpr std::array<Eigen::Index, 2> axes[] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  for (const Eigen::Index axis : {0, 1, 2})
    if (!bounded(setup, axis))
      refuse(
          fmt::format("nothing bounds the sample along {0}, so that it has no volume and no stress; give "
                      "cell.lengths[{1}], or walls at both ends",
                      "xyz"[axis], axis));
  if (!setup.clumps.empty())
    refuse(
        "grains that are no spheres cannot push a cell yet; take shape = \"sphere\", or strain_rates and "
        "shear_rates instead of a stress");
  const CellVelocity rates{stage.strain_rates[0], stage.strain_rates[1], stage.strain_rates[2],
                           stage.shear_rates[0],  stage.shear_rates[1],  stage.shear_rates[2]};
  for (std::size_t k = 0; k < cell_freedoms; ++k) {
    const auto [first, second] = axes[k];
    if (load.to[k] && (setup.domain.edges()[first] == 0 || setup.domain.edges()[second] == 0))
      refuse_key(names[k],
                 fmt::format("the cell is not periodic along {}, so that nothing follows it; load the walls "
                             "there, or give all of cell.lengths",
                             "xyz"[setup.domain.edges()[first] == 0 ? first : second]));
    if (load.to[k] && rates[k] != 0)
      refuse_key(names[k], "has a rate, too; a component follows either a rate or a stress");
    const std::string amplitude = fmt::format("amplitude_{}", names[k]);
    if (load.to[k] && !std::isfinite(*load.to[k])) refuse_key(names[k], "must be finite [Pa]");
    if (!std::isfinite(load.amplitude[k])) refuse_key(amplitude, "must be finite [Pa]");
    if (!load.to[k] && load.amplitude[k] != 0)
      refuse_key(amplitude, fmt::format("swings about {}, which is not given", names[k]));
  }
  if (swings && !(load.period > 0)) refuse_key("period", "swings need one > 0 [s]");
  const double step = stage.longest_step();
  constexpr double steps = 4;  // in which a swing still has its amplitude
  if (swings && load.period < steps * step)
    refuse_key(
        "period",
        fmt::format("swings of a period of {} s are not seen in steps of up to {} s; make {} a quarter "
                    "of the period at most",
                    load.period, step, stage.chooses_time_step ? "time_step_max" : "time_step"));
  if (!(load.ramp_time >= 0 && std::isfinite(load.ramp_time)))
    refuse_key("ramp_time", "must be a number >= 0 [s]");
}

/// "" or what is wrong with the size of a part of space, where all images in it count.
std::string too_wide(const Domain& domain, const Bounds& box) {
  constexpr double most = 16, farthest = 1e6;  // edges
  const Vec3 edges = domain.edges();
  for (const Eigen::Index axis : {0, 1, 2})
    if (edges[axis] > 0 && !((box.low - domain.low).cwiseAbs()[axis] <= farthest * edges[axis]))
      return fmt::format("is more than {:g} edges away from the cell along {}", farthest, "xyz"[axis]);
  for (const Eigen::Index axis : {0, 1, 2})
    if (edges[axis] > 0 && !(box.high[axis] - box.low[axis] <= most * edges[axis]))
      return fmt::format("is more than {} edges of the cell long along {}; all images in it count", most,
                         "xyz"[axis]);
  return "";
}

}  // namespace

std::string fault_in_cell(const Setup& setup, const Region& region) {
  if (!setup.domain.repeats) return "";
  const Eigen::Array<bool, 3, 1> repeats = setup.domain.edges().array() > 0,
                                 along = region.normal.array() != 0;
  const bool across = (repeats && along).any();  // of a plane
  if (region.is_surface() && (any_stress(setup) || std::ranges::any_of(setup.stages, &Stage::flows)))
    return "is a surface, and the edges of the cell move: what goes through it is not counted there";
  switch (region.kind) {
    case Region::Kind::beyond:
      return across ? "is all beyond a plane across an axis along which the cell repeats: every grain has an "
                      "image there; give a box"
                    : "";
    case Region::Kind::plane:
      if (across && along.count() > 1) return "is a plane; in a cell its normal has to lie along x, y or z";
      return across ? too_wide(setup.domain, {region.point, region.point}) : "";
    default:
      return too_wide(setup.domain, bounds_of(region));
  }
}

std::string fault_in_cell(const Setup& setup, const FieldRule& field) {
  const Vec3 reach = Vec3::Constant(Lucy(field.width).cutoff());
  const std::string fault = too_wide(setup.domain, {field.low - reach, field.high + reach});
  return fault.empty() ? "" : "with what it spreads grains over " + fault;
}

bool bounded(const Setup& setup, Eigen::Index axis) {
  const auto faces = [&](double direction) {
    return std::ranges::any_of(setup.walls, [&](const Wall& wall) { return wall.normal[axis] == direction; });
  };
  return setup.domain.edges()[axis] > 0 || (faces(1) && faces(-1));
}

bool any_stress(const Setup& setup) {
  return std::ranges::any_of(setup.stages, [](const Stage& stage) { return stage.stress.any(); });
}

namespace {

/// How a cell may lie and lean. A lean by whole edges gives the same images, so that no larger one is needed;
/// farther away places have too few digits for what is small beside the cell.
struct CellLimits {
  double lean = 2;        ///< a shear over the longer of its edges, >= 1
  double distance = 1e9;  ///< the origin over an edge, > 1
};

void validate_place(const Domain& domain) {
  const Vec3 edges = domain.edges();
  const double shears[] = {domain.cell.xy, domain.cell.xz, domain.cell.yz};
  constexpr Eigen::Index axes[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  constexpr CellLimits limits;
  for (const Eigen::Index k : {0, 1, 2}) {
    if (std::abs(shears[k]) > limits.lean * std::max(edges[axes[k][0]], edges[axes[k][1]]))
      throw std::invalid_argument("a shear is more than twice the longer of its edges");
    if (edges[k] > 0 && std::abs(domain.low[k]) > limits.distance * edges[k])
      throw std::invalid_argument("its origin is more than 1e9 edges away");
  }
}

}  // namespace

void validate_cell(const Setup& setup) {
  if (!(setup.cell_inertia > 0 && std::isfinite(setup.cell_inertia)))
    throw std::invalid_argument("cell: inertia must be a number > 0");
  for (const Stage& stage : setup.stages) {
    validate_flow(setup, stage);
    validate_stress(setup, stage);
  }
  if (!setup.domain.repeats) return;
  validate_place(setup.domain);
  const auto refuse = [](const std::string& what) { throw std::invalid_argument(what); };
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
  for (const ProbeRule& probe : setup.probes)
    if (const std::string fault = fault_in_cell(setup, probe.region); !fault.empty())
      refuse(fmt::format("probe '{}' {}", probe.name, fault));
  for (const FieldRule& field : setup.fields)
    if (const std::string fault = fault_in_cell(setup, field); !fault.empty())
      refuse(fmt::format("field '{}' {}", field.name, fault));
}

void validate_coupling(const Setup& setup) {
  if (setup.decomposition.coupling != Coupling::nscdd && any_stress(setup))
    throw std::invalid_argument(
        "a cell that follows a stress is coupled by \"nscdd\" alone, in which each subdomain pushes its own "
        "share of the cell's mass; leave decomposition.coupling out, or the stress of the stages");
}

void validate_correction(const Setup& setup) {
  if (setup.solver.overlap_correction > 0 && any_stress(setup))
    throw std::invalid_argument(
        "what it pushes apart in a cell that follows a stress is closed again by the stress, and overlaps "
        "grow; "
        "take 0, and a smaller tolerance if overlaps are too large");
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
          "cell: {} m along {} is less than {} m, twice the sum of the largest diameter and the distance at "
          "which candidates are looked for (alert and skin): a grain would touch two images of another. Make "
          "the cell larger, or the grains smaller",
          edge, "xyz"[axis], least));
  }
}

}  // namespace talus
