#include "runtime/step/setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "kernels/bodies/bodies.hpp"
#include "kernels/law/law_numbers.hpp"
#include "runtime/step/cell.hpp"
#include "runtime/step/field_grids.hpp"

namespace talus {

namespace {
void require(bool holds, const std::string& message) {
  if (!holds) throw std::invalid_argument(message);
}

void validate_load(const std::string& where, const Wall& wall, const WallLoad& load) {
  require(wall.surface() == nullptr || load.drive == WallDrive::fixed,
          fmt::format("{}: only planes can be driven or pushed; a wall with shape = \"{}\" is moved "
                      "by a motion",
                      where, wall.shape.name));
  require(wall.motion.empty() || load.drive == WallDrive::fixed,
          where + ": it has a prescribed motion, and that alone moves it");
  require(load.velocity.allFinite(), where + ": velocity must be finite [m/s]");
  require(std::isfinite(load.pressure),
          fmt::format("{}: pressure must be finite [Pa], got {}", where, load.pressure));
  require(std::isfinite(load.force), fmt::format("{}: force must be finite [N], got {}", where, load.force));
  if (!load.pushed()) return;
  require(std::abs(load.velocity.dot(wall.normal)) <= 1e-9 * load.velocity.norm(),
          where + ": tangential_velocity must lie in its face: what is pushed is free along its normal");
  require(mass_is_sound(load.mass), fmt::format("{}: a pushed wall needs a mass of {} to {} kg, got {}",
                                                where, least_mass, most_mass, load.mass));
}
}  // namespace

const Registry<Coupling>& couplings() {
  static constexpr Entry<Coupling> entries[] = {
      {Coupling::nscdd, "nscdd", "copies of a body share its mass and are glued"},
      {Coupling::alternating, "alternating",
       "likewise, but in turns: half of the subdomains sweep their borders when they know what the others "
       "did, and it takes as many sweeps as with one subdomain"},
      {Coupling::schwarz, "schwarz", "copies have the whole mass and exchange what they gain"}};
  static constexpr Registry<Coupling> registry("coupling", entries);
  return registry;
}

namespace {

void validate_motion(const std::string& where, const MotionPart& part) {
  require(part.velocity.allFinite() && part.point.allFinite() && std::isfinite(part.rate) &&
              std::isfinite(part.amplitude) && std::isfinite(part.frequency) && std::isfinite(part.phase),
          where + ": numbers of its motion must be finite");
  require(!part.turns() || std::abs(part.axis.norm() - 1) < 1e-9,
          where + ": the axis of its motion must be a unit vector");
  if (part.kind == MotionPart::Kind::oscillation)
    require(std::abs(part.direction.norm() - 1) < 1e-9 && part.frequency > 0,
            where + ": it oscillates along a unit vector with a frequency > 0");
  if (part.kind == MotionPart::Kind::table)
    require(part.table && part.table->t.size() > 1, where + ": the table of its motion needs two rows");
}

void validate_laws(const Stage& stage) {
  for (const PairLaw& law : stage.laws.laws())
    for (const LawNumberEntry& entry : law_numbers()) {
      const double value = entry.number.in(law);
      require(value >= 0 && value <= entry.most && std::isfinite(value),
              std::isfinite(entry.most)
                  ? fmt::format("stage '{}': {} must lie in [0, {}], got {}", stage.name, entry.name,
                                entry.most, value)
                  : fmt::format("stage '{}': {} must be finite and >= 0{}{}, got {}", stage.name, entry.name,
                                *entry.unit == '\0' ? "" : " ", entry.unit, value));
    }
  // The largest of all pairs: pairs of walls have no friction, and never meet.
  const double resistance = stage.laws.largest(&PairLaw::rolling_resistance);
  require(resistance == 0 || stage.laws.largest(&PairLaw::friction) > 0,
          fmt::format("stage '{}': rolling_resistance = {} needs friction: without it nothing rolls",
                      stage.name, resistance));
}

void validate_time_step(const Stage& stage) {
  if (!stage.chooses_time_step) {
    require(
        stage.time_step > 0 && std::isfinite(stage.time_step),
        fmt::format("stage '{}': time_step must be finite and > 0 s, got {}", stage.name, stage.time_step));
    require(
        !stage.end.time || steps_in(*stage.end.time, stage.time_step) >= 1,
        fmt::format(
            "stage '{}': end.time = {} s is not more than half a time step of {} s: no step would be made",
            stage.name, stage.end.time.value_or(0), stage.time_step));
    return;
  }
  const double most = stage.time_step_max, least = stage.time_step_min;
  require(most >= 0 && std::isfinite(most) && least >= 0 && std::isfinite(least),
          fmt::format("stage '{}': time_step_max and time_step_min must be finite and > 0 s, got {} and {}",
                      stage.name, most, least));
  require(
      most > 0 || stage.gravity.norm() > 0,
      fmt::format("stage '{}': time_step = \"auto\" without gravity needs time_step_max [s]", stage.name));
  require(
      most == 0 || least <= most,
      fmt::format("stage '{}': time_step_min = {} s is above time_step_max = {} s", stage.name, least, most));
}

bool rolls(const Setup& setup) {
  return std::ranges::any_of(
      setup.stages, [](const Stage& stage) { return stage.laws.largest(&PairLaw::rolling_resistance) > 0; });
}

/// For contacts (`what`) whose history cannot be carried on from sweep to sweep, and which cannot be damped.
void demand_plain_sweeps(const Setup& setup, const std::string& what) {
  require(setup.solver.method != SolverMethod::momentum && setup.solver.method != SolverMethod::nncg,
          fmt::format("solver.method = \"{}\": {} cannot be carried on. Take \"auto\" or \"nlgs\"",
                      setup.solver.method.name(), what));
  require(setup.decomposition.coupling != Coupling::schwarz,
          fmt::format("decomposition.coupling = \"schwarz\": {} are not damped. Take \"alternating\" or "
                      "\"nscdd\"",
                      what));
}

void validate_clumps(const Setup& setup) {
  require(setup.clumps.size() <= most_clumps,
          fmt::format("{} shapes of clumps, of at most {}", setup.clumps.size(), most_clumps));
  require(!rolls(setup), "rolling_resistance: clumps have none; their shape resists");
  demand_plain_sweeps(setup, "contacts of clumps");
}

}  // namespace

namespace {

void validate_grains(const Setup& setup) {
  for (const InsertRule& rule : setup.inserts) {
    const std::string where = fmt::format("insert '{}'", rule.name);
    const std::string radii = fault_of(rule.radii), region = fault_of(rule.region);
    require(radii.empty(), fmt::format("{}: {}", where, radii));
    require(region.empty(), fmt::format("{}: {}", where, region));
    require(rule.region.kind != Region::Kind::beyond, where + ": the region must be bounded");
    require(has_room(rule.region, largest_radius(rule.radii)), where + ": no grain fits into the region");
    require(rule.count || rule.mass || rule.rate || rule.mass_rate,
            where + ": count, mass, rate or mass_rate is needed");
    require(rule.density > 0 && rule.velocity.allFinite(), where + ": density or velocity makes no sense");
    for (const Stage& stage : setup.stages)
      require(stage.laws.knows(rule.material),
              fmt::format("stage '{}': its laws do not have material {} of {}", stage.name, rule.material,
                          where));
  }
  for (const RemoveRule& rule : setup.removes) {
    const std::string region = fault_of(rule.region);
    require(region.empty(), fmt::format("remove '{}': {}", rule.name, region));
    for (const double at : rule.at)
      require(at >= rule.times.from && at < rule.times.until,
              fmt::format("remove '{}': at = {} s is not within from = {} s and until = {} s. Change one of "
                          "them, or leave from and until away",
                          rule.name, at, rule.times.from, rule.times.until));
  }
}

void validate_probes(const Setup& setup) {
  for (const ProbeRule& rule : setup.probes) {
    const std::string where = fmt::format("probe '{}'", rule.name), region = fault_of(rule.region);
    require(region.empty(), fmt::format("{}: {}", where, region));
    require(rule.every_steps.value_or(1) > 0 && rule.every.value_or(1) > 0,
            where + ": every and every_steps must exceed 0");
  }
  for (const FieldRule& rule : setup.fields) {
    const std::string where = fmt::format("field '{}'", rule.name), fault = fault_of(rule);
    require(fault.empty(), fmt::format("{}: {}", where, fault));
  }
}

void validate_end(const Setup& setup, const Stage& stage) {
  const StageEnd& end = stage.end;
  const auto demand = [&](bool holds, const char* what) {
    require(holds, fmt::format("stage '{}': end.{}", stage.name, what));
  };
  require(end.any(), fmt::format("stage '{}': no end condition (steps, time, strain, shear_strain, "
                                 "equilibrium, stress_ratio, inertial_below, inertial_above or steady)",
                                 stage.name));
  demand(end.equilibrium_hold >= 0 && std::isfinite(end.equilibrium_hold),
         "equilibrium_hold must be finite and >= 0");
  demand(end.inertial_hold >= 0 && std::isfinite(end.inertial_hold), "inertial_hold must be finite and >= 0");
  demand(end.stress_ratio.value_or(1) > 0 && end.steady.value_or(1) > 0 &&
             end.inertial_below.value_or(1) > 0 && end.inertial_above.value_or(1) > 0,
         "stress_ratio, steady, inertial_below and inertial_above must be > 0");
  demand(end.steady_strain > 0 && end.steady_time.value_or(1) > 0,
         "steady_strain and steady_time must be > 0");
  const bool flows = setup.domain.repeats && stage.flows();
  demand(flows || (!end.inertial_below && !end.inertial_above),
         "inertial_below and inertial_above need a periodic cell that flows");
  demand(flows || !end.steady || end.steady_time,
         "steady needs steady_time where no periodic cell flows, whose shear is the measure otherwise");
}

}  // namespace

void validate(const Setup& setup) {
  for (const Wall& wall : setup.walls) {
    require(wall.surface() != nullptr || std::abs(wall.normal.norm() - 1) < 1e-9,
            fmt::format("wall '{}': normal must be a unit vector", wall.name));
    require(wall.point.allFinite() && wall.velocity.allFinite(),
            fmt::format("wall '{}': point and velocity must be finite", wall.name));
    validate_load(fmt::format("wall '{}'", wall.name), wall, wall.load);
    for (const MotionPart& part : wall.motion) validate_motion(fmt::format("wall '{}'", wall.name), part);
  }
  require(!setup.stages.empty(), "at least one stage is needed");
  validate_grains(setup);
  validate_probes(setup);
  for (const Stage& stage : setup.stages) {
    validate_time_step(stage);
    require(stage.gravity.allFinite(), fmt::format("stage '{}': gravity must be finite [m/s^2]", stage.name));
    validate_laws(stage);
    for (const Wall& wall : setup.walls)
      require(stage.laws.knows(wall.material),
              fmt::format("stage '{}': its laws do not have material {} of wall '{}'", stage.name,
                          wall.material, wall.name));
    validate_end(setup, stage);
    for (const auto& [name, load] : stage.loads) {
      const auto wall = std::find_if(setup.walls.begin(), setup.walls.end(),
                                     [&name = name](const Wall& w) { return w.name == name; });
      require(wall != setup.walls.end(), fmt::format("stage '{}': no wall is named '{}'", stage.name, name));
      validate_load(fmt::format("stage '{}', wall '{}'", stage.name, name), *wall, load);
    }
  }
  require(setup.solver.tolerance >= 0 && setup.solver.balance_tolerance >= 0,
          fmt::format("solver.tolerance and balance_tolerance must be >= 0, got {} and {}",
                      setup.solver.tolerance, setup.solver.balance_tolerance));
  require(setup.solver.overlap_tolerance > 0,
          fmt::format("solver.overlap_tolerance must be > 0, got {}", setup.solver.overlap_tolerance));
  require(setup.solver.max_iterations >= 1, "solver.max_iterations must be >= 1");
  require(setup.solver.direct_bodies >= 0, "solver.direct_bodies must be >= 0");
  require(
      setup.solver.method != SolverMethod::momentum || setup.decomposition.coupling != Coupling::schwarz,
      "solver.method = \"nlgs+momentum\": Schwarz adds up what all copies of a body carry on, and diverges. "
      "Take \"auto\", or another decomposition.coupling");
  if (rolls(setup)) demand_plain_sweeps(setup, "moments of rolling resistance");
  if (!setup.clumps.empty()) validate_clumps(setup);
  validate_cell(setup);
  validate_coupling(setup);
  validate_correction(setup);
  require(setup.solver.check_every >= 2, "solver.check_every must be >= 2");
  require(
      setup.solver.overlap_correction >= 0 && setup.solver.overlap_correction <= 1,
      fmt::format("solver.overlap_correction must lie in [0, 1], got {}", setup.solver.overlap_correction));
  require(setup.solver.overlap_correction == 0 || setup.decomposition.coupling != Coupling::schwarz,
          "solver.overlap_correction: Schwarz does not glue displacements. Set it to 0, or coupling to "
          "\"alternating\" or \"nscdd\"");
  require(setup.decomposition.repartition_every >= 1 && setup.decomposition.sweeps_per_exchange >= 1,
          "decomposition.repartition_every and sweeps_per_exchange must be >= 1");
  require(
      setup.decomposition.coupling != Coupling::alternating || setup.decomposition.sweeps_per_exchange == 1,
      fmt::format("decomposition.sweeps_per_exchange = {}: subdomains that alternate exchange in every "
                  "sweep. Set it to 1, or coupling to \"nscdd\"",
                  setup.decomposition.sweeps_per_exchange));
}

}  // namespace talus
