#include "apps/commands/run_findings.hpp"

#include <fmt/format.h>

namespace talus {

namespace {

using Findings = std::vector<std::string>;

std::string steps_of(std::int64_t count) {
  return counted(static_cast<std::size_t>(count), "step");
}

/// What the overlaps of a run could be mended by; "" where nothing is known.
std::string remedy_of_overlaps(const Tally& tally, const std::vector<Wall>& walls) {
  std::string text;
  if (const auto enough = tally.enough_time_step())
    text = fmt::format(". A time_step of {:.2g} s would do", *enough);
  const std::int64_t with = tally.deepest.overlapping->with;
  if (with >= 0 || walls[static_cast<std::size_t>(-1 - with)].from_stage.empty()) return text;
  return text + fmt::format(". Where grains stood as that wall appeared, in stage '{}', no time_step will",
                            walls[static_cast<std::size_t>(-1 - with)].from_stage);
}

void add_passages(const Simulation& simulation, const Tally& tally, Findings& all) {
  if (tally.passed > 0)
    all.push_back(
        fmt::format("a grain went through what it met, or deep into it, within one step, in {}; "
                    "these steps count as unconverged. Reduce time_step",
                    counted(static_cast<std::size_t>(tally.passed), "case")));
  if (tally.overlapped == 0) return;
  const std::vector<Wall>& walls = simulation.setup().walls;
  all.push_back(fmt::format(
      "{} ended with overlaps beyond solver.overlap_tolerance = {:.2g}: the deepest, {:.2g} of the "
      "smaller radius, of {} in step {}; overlap_body and overlap_with in steps.csv name one of "
      "each step{}",
      steps_of(tally.overlapped), simulation.setup().solver.overlap_tolerance, tally.deepest.overlap,
      name_of(*tally.deepest.overlapping, walls), tally.deepest.step, remedy_of_overlaps(tally, walls)));
}

void add_misses(const Simulation& simulation, const Tally& tally, Findings& all) {
  const SolverSettings& solver = simulation.setup().solver;
  const std::vector<Wall>& walls = simulation.setup().walls;
  if (tally.unanswered > 0)
    all.push_back(fmt::format(
        "in {} nothing is known of some small cluster of contacts: within {} sweeps its direct solve found "
        "no answer, and `balance` is 1 or more. Raise solver.max_iterations, or leave such clusters to "
        "estimates, which may take a wrong step for right: solver.direct_bodies = 0 (docs/certificate.md)",
        steps_of(tally.unanswered), solver.max_iterations));
  // A step that another tolerance missed may have contacts that are all right: to name one would mislead.
  if (const WorstErrors& worst = tally.furthest.worst; worst.contact_error > solver.tolerance)
    all.push_back(fmt::format(
        "of the steps that missed, step {} is the furthest off: at the contact of {} by {:.2g} of "
        "its velocities, and {} by {:.2g}; worst_* in steps.csv name those of each",
        tally.furthest.step, name_of(worst.contact, walls), worst.contact_error, name_of(worst.body, walls),
        worst.body_error));
  if (tally.stagnated > 0)
    all.push_back(fmt::format(
        "in {} the error stood still above the tolerance, at {:.2g} at worst; more sweeps do not help, so "
        "they ended there. Raise solver.tolerance above it, reduce time_step, or try another solver.method",
        steps_of(tally.stagnated), tally.floor));
  if (tally.locked > 0)
    all.push_back(fmt::format(
        "in {} walls close on grains that friction does not let get away, as a wedge that is narrower than "
        "twice the angle of friction holds what is in it: a solution was not found, and may not exist. "
        "Push such walls with a force instead of a velocity, leave more room or less than a grain between "
        "them, lower the friction there, or slow them down",
        steps_of(tally.locked)));
  if (tally.jammed == 0) return;
  const bool newton = simulation.setup().solver.restitution_law == RestitutionLaw::newton;
  all.push_back(fmt::format(
      "in {} walls close on grains that cannot get away, or a cell does, or rebounds between near walls: no "
      "velocities keep all contacts from approaching, so these steps have no solution and ended early. Push "
      "walls with a force and cells with a stress instead of a velocity, slow them down, or remove what "
      "overlaps there; for such rebounds take {}a shorter time_step",
      steps_of(tally.jammed), newton ? "restitution_law = \"moreau\" or " : ""));
}

void add_grains(const Simulation& simulation, Findings& all) {
  for (const InsertReport& insert : simulation.inserted()) {
    if (simulation.finished() && insert.placed == 0 && insert.no_room == 0)
      all.push_back(
          fmt::format("insert '{}' placed no grain: none was due before the run ended. Its `stage`, `from`, "
                      "`until` and `interval` leave it no time in this run, or the first that its rate "
                      "brings comes later",
                      insert.name));
    if (insert.no_room > 0 && insert.waiting > 0)
      all.push_back(fmt::format(
          "insert '{}' had no room for a grain in {}, and {} wait still; \"waiting\" in "
          "inserted.csv says when. Enlarge its region, raise its velocity, or ask for fewer",
          insert.name, steps_of(insert.no_room), counted(static_cast<std::size_t>(insert.waiting), "grain")));
  }
  if (!simulation.removed().empty() && simulation.bodies() == 0) all.push_back("no grain is left at the end");
}

}  // namespace

Findings run_findings(const Simulation& simulation, const Tally& tally) {
  Findings all;
  add_grains(simulation, all);
  add_passages(simulation, tally, all);
  add_misses(simulation, tally, all);
  return all;
}

}  // namespace talus
