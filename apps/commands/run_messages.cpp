#include "apps/commands/run_messages.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cstdio>

#include "apps/shared/exit_codes.hpp"
#include "kernels/bodies/larger.hpp"

namespace talus {

void Tally::add(const Simulation& simulation) {
  const StepReport& report = simulation.report();
  exposed += simulation.exposed();
  iterating += simulation.sums().times.iteration;
  lately += simulation.sums().times.iteration;
  small += simulation.sums().times.small;
  iterations += report.iterations;
  if (!report.converged) ++unconverged;
  passed += report.passed;
  if (simulation.iterations().stagnated) {
    ++stagnated;
    floor = std::max(floor, report.error_rms);
  }
  if (simulation.iterations().jammed)
    ++jammed;
  else if (simulation.iterations().unanswered && !report.converged)
    ++unanswered;
  worst_error = larger(worst_error, report.error_rms);
  worst_balance = larger(worst_balance, report.balance);
  if (report.converged) worst_velocity = larger(worst_velocity, report.velocity_error);
  worst_penetration = larger(worst_penetration, report.penetration_max);
  if (report.worst.contact_error > furthest.worst.contact_error) furthest = report;
  add_overlap(simulation);
}

void Tally::add_overlap(const Simulation& simulation) {
  const StepReport& report = simulation.report();
  const double tolerance = simulation.setup().solver.overlap_tolerance;
  worst_overlap = larger(worst_overlap, report.overlap);
  if (report.overlap > tolerance) {
    if (overlapped++ == 0 || report.overlap > deepest.overlap) deepest = report;
    // Where in a step an impact falls is chance: another step would have been missed by more.
    constexpr double margin = 0.5;
    const double enough = margin * report.time_step * tolerance / report.overlap;
    // Steps that only keep what was made before say nothing of their own time step.
    if (report.overlap > last_overlap && (sufficient_time_step == 0 || enough < sufficient_time_step))
      sufficient_time_step = enough;
  }
  last_overlap = report.overlap;
}

void Tally::sum_up(const StepReport& last, io::Summary& summary) const {
  summary.steps = last.step;
  summary.time = last.time;
  summary.iterations = iterations;
  summary.unconverged_steps = unconverged;
  summary.converged_steps = last.step - unconverged;
  summary.worst_error_rms = worst_error;
  summary.worst_balance = worst_balance;
  summary.worst_velocity_error = worst_velocity;
  summary.worst_penetration = worst_penetration;
  summary.overlapping_steps = overlapped;
  summary.worst_overlap = worst_overlap;
  if (sufficient_time_step > 0) summary.sufficient_time_step = sufficient_time_step;
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string contents(const io::Scene& scene, std::size_t grains) {
  return fmt::format("{}, {}, {}", counted(grains, "grain"), counted(scene.setup.walls.size(), "wall"),
                     counted(scene.setup.stages.size(), "stage"));
}

void print_start(const Terminal& terminal, const io::Scene& scene, std::size_t grains, int threads,
                 const graph::Communicator& ranks) {
  terminal.say("{}, {}", scene.name, contents(scene, grains));
  const auto count = [](int n, const char* what) { return counted(static_cast<std::size_t>(n), what); };
  const int cores = omp_get_num_procs();
  terminal.say("{}, {} each, {} for this process, MPI threads: {}", count(ranks.ranks(), "rank"),
               count(threads, "thread"), count(cores, "core"), ranks.thread_level());
  if (scene.setup.decomposition.subdomains > 1 || ranks.ranks() > 1)
    terminal.say("{} by {}, {}, {}",
                 count(std::max(scene.setup.decomposition.subdomains, ranks.ranks()), "subdomain"),
                 name_of(scene.setup.decomposition.partitioner),
                 couplings().of(scene.setup.decomposition.coupling).name,
                 scene.setup.decomposition.exchange == ExchangeScheme::dcs ? "DCS" : "CCS");
  // Ranks that are bound have cores of their own; unbound ones share those of the machine.
  const bool bound = cores < io::collect_provenance().cores_online;
  if (threads * (bound ? 1 : ranks.ranks_on_node()) > cores)
    terminal.warn("warning: more threads than cores; results are the same, the run is slower");
}

void print_stage_end(const Terminal& terminal, const Simulation& simulation) {
  const StageEnd& end = simulation.stage().end;
  terminal.say("stage '{}' ended after {}: {} reached{}", simulation.stage().name,
               counted(static_cast<std::size_t>(simulation.steps_of_stage()), "step"),
               simulation.end_reached(),
               end.equilibrium ? fmt::format(", equilibrium {:.2g} (asked {:.2g})",
                                             simulation.report().equilibrium, *end.equilibrium)
                               : "");
}

std::string name_of(std::int64_t body, const std::vector<Wall>& walls) {
  if (body >= 0) return fmt::format("body {}", body);
  return fmt::format("wall '{}'", walls[static_cast<std::size_t>(-1 - body)].name);
}

std::string name_of(const BodyPair& pair, const std::vector<Wall>& walls) {
  if (pair.with < 0) return fmt::format("body {} and {}", pair.body, name_of(pair.with, walls));
  return fmt::format("bodies {} and {}", pair.body, pair.with);
}

namespace {

std::string remedy_of_overlaps(const Tally& tally, const std::vector<Wall>& walls) {
  std::string text;
  if (tally.sufficient_time_step > 0)
    text = fmt::format(". A time_step of {:.2g} s would do", tally.sufficient_time_step);
  const std::int64_t with = tally.deepest.overlapping->with;
  if (with >= 0 || walls[static_cast<std::size_t>(-1 - with)].from_stage.empty()) return text;
  return text + fmt::format("; but where grains stood as that wall appeared, in stage '{}', none will",
                            walls[static_cast<std::size_t>(-1 - with)].from_stage);
}

/// What came and went, and what found no room.
void print_grains(const Terminal& terminal, const Simulation& simulation) {
  for (const InsertReport& insert : simulation.inserted()) {
    terminal.say("insert '{}': {} placed, {:.6g} kg", insert.name,
                 counted(static_cast<std::size_t>(insert.placed), "grain"), insert.mass);
    if (simulation.finished() && insert.placed == 0 && insert.no_room == 0)
      terminal.warn(
          "warning: insert '{}' placed no grain, as none was due: its `stage`, `from` and `until` leave it "
          "no time in this run, or its rate is too low",
          insert.name);
    if (insert.no_room > 0 && insert.waiting > 0)
      terminal.warn(
          "warning: insert '{}' had no room for a grain in {}, and {} wait still; \"waiting\" in "
          "inserted.csv says when. Enlarge its region, raise its velocity, or ask for fewer",
          insert.name, counted(static_cast<std::size_t>(insert.no_room), "step"),
          counted(static_cast<std::size_t>(insert.waiting), "grain"));
    else if (insert.no_room > 0)
      terminal.say("insert '{}' had no room for a grain in {}; all that were due have come", insert.name,
                   counted(static_cast<std::size_t>(insert.no_room), "step"));
  }
  for (const RemoveReport& remove : simulation.removed())
    terminal.say("remove '{}': {}{}, {:.6g} kg", remove.name,
                 counted(static_cast<std::size_t>(remove.count), "grain"),
                 remove.material.empty() ? "" : fmt::format(" of '{}'", remove.material), remove.mass);
  if (!simulation.removed().empty() && simulation.bodies() == 0)
    terminal.warn("warning: no grain is left at the end");
}

}  // namespace

void print_notes(const Terminal& terminal, const Simulation& simulation, const Tally& tally) {
  print_grains(terminal, simulation);
  const MessageCount& messages = simulation.messages();
  if (messages.messages > 0)
    terminal.say(
        "an exchange: {} messages of {} bytes between subdomains, {} of {} between ranks; "
        "waiting for them took {:.1f} % of the iterations on rank 0",
        messages.messages, messages.bytes, messages.between_ranks, messages.bytes_between_ranks,
        tally.iterating > 0 ? 100 * tally.exposed / tally.iterating : 0.0);
  constexpr double worth_a_word = 1;  // s, and half of the iterations
  if (simulation.setup().solver.direct_bodies > 0 && tally.small > worth_a_word &&
      tally.small > 0.5 * tally.lately)
    terminal.say(
        "direct solves of small clusters, which show how far their velocities and forces are off, took "
        "{:.3g} of the {:.3g} s of the iterations; solver.direct_bodies = 0 leaves that to estimates "
        "(docs/certificate.md)",
        tally.small, tally.lately);
  if (tally.passed > 0)
    terminal.warn(
        "warning: a grain went through what it met, or deep into it, within one step, in {}; "
        "these steps count as unconverged. Reduce time_step",
        counted(static_cast<std::size_t>(tally.passed), "case"));
  if (tally.overlapped > 0)
    terminal.warn(
        "warning: {} ended with overlaps beyond solver.overlap_tolerance = {:.2g}: the deepest, "
        "{:.2g} of the smaller radius, of {} in step {}; overlap_body and overlap_with in steps.csv "
        "name one of each step{}",
        counted(static_cast<std::size_t>(tally.overlapped), "step"),
        simulation.setup().solver.overlap_tolerance, tally.deepest.overlap,
        name_of(*tally.deepest.overlapping, simulation.setup().walls), tally.deepest.step,
        remedy_of_overlaps(tally, simulation.setup().walls));
  const SolverSettings& solver = simulation.setup().solver;
  if (tally.unanswered > 0)
    terminal.warn(
        "warning: in {} nothing is known of some small cluster of contacts: within {} sweeps its direct "
        "solve "
        "found no answer, and `balance` is 1 or more. Raise solver.max_iterations, or leave such clusters to "
        "estimates, which may take a wrong step for right: solver.direct_bodies = 0 (docs/certificate.md)",
        counted(static_cast<std::size_t>(tally.unanswered), "step"), solver.max_iterations);
  // A step that another tolerance missed may have contacts that are all right: to name one would mislead.
  if (const WorstErrors& worst = tally.furthest.worst; worst.contact_error > solver.tolerance)
    terminal.warn(
        "warning: of the steps that missed, step {} is the furthest off: at the contact of {} by {:.2g} of "
        "its velocities, and {} by {:.2g}; worst_* in steps.csv name those of each",
        tally.furthest.step, name_of(worst.contact, simulation.setup().walls), worst.contact_error,
        name_of(worst.body, simulation.setup().walls), worst.body_error);
  if (tally.stagnated > 0)
    terminal.warn(
        "warning: in {} the error stood still above the tolerance, at {:.2g} at worst; "
        "more sweeps do not help, so they ended there. Raise solver.tolerance above it, reduce "
        "time_step, or try another solver.method",
        counted(static_cast<std::size_t>(tally.stagnated), "step"), tally.floor);
  if (tally.jammed > 0)
    terminal.warn(
        "warning: in {} walls close on grains that cannot get away, or a cell does, or rebounds between near "
        "walls: no velocities keep all contacts from approaching, so these steps have no solution and ended "
        "early. Push walls with a force and cells with a stress instead of a velocity, slow them down, or "
        "remove what overlaps there; for such rebounds take restitution_law = \"moreau\" or a shorter "
        "time_step",
        counted(static_cast<std::size_t>(tally.jammed), "step"));
}

/// Overlaps are a matter of the time step alone.
std::string remedy_of_misses(const io::Summary& summary) {
  const bool overlaps_alone = summary.unconverged_steps == summary.overlapping_steps;
  std::string remedy = "Raise solver.max_iterations, reduce time_step";
  if (overlaps_alone) remedy = "Reduce time_step";
  if (summary.exit_code == exit_tolerance_missed) remedy += ", or accept them with allow_unconverged = true";
  return remedy;
}

void print_end(const Terminal& terminal, const io::Summary& summary, const SolverSettings& solver,
               const std::string& directory) {
  if (!summary.message.empty()) {
    if (summary.status == "stopped")
      terminal.warn("stopped: {}", summary.message);
    else if (summary.exit_code == exit_failure)
      terminal.warn("error: {}", summary.message);
    else
      terminal.say("{}", summary.message);
  }
  const std::string digest = summary.digest ? fmt::format(", digest {:016x}", *summary.digest) : "";
  terminal.say("{}, {:.6g} s simulated in {:.1f} s, {} sweeps{}",
               counted(static_cast<std::size_t>(summary.steps), "step"), summary.time, summary.wall_s,
               summary.iterations, digest);
  if (summary.unconverged_steps > 0)
    terminal.say(
        "{} of {} steps missed the tolerance: worst error {:.2e} (allowed {:.2g}), worst balance "
        "{:.2e} (allowed {:.2g}), worst overlap {:.2g} (allowed {:.2g}); `converged` in steps.csv says "
        "which. {}",
        summary.unconverged_steps, summary.steps, summary.worst_error_rms, solver.tolerance,
        summary.worst_balance, solver.balance_tolerance, summary.worst_overlap, solver.overlap_tolerance,
        remedy_of_misses(summary));
  if (summary.worst_velocity_error > solver.balance_tolerance)
    terminal.say(
        "velocities of clusters too large for a direct solve: estimated to be within {:.2g} of what contacts "
        "change in them in a step, with friction of the largest wall force if that is less, at worst "
        "(`velocity_error` in steps.csv); solver.velocity_tolerance bounds it",
        summary.worst_velocity_error);
  terminal.say("results in {}", directory);
}

}  // namespace talus
