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
  if (!report.converged) {
    const AnswerState answers = simulation.iterations().answers;
    jammed += answers == AnswerState::jammed;
    locked += answers == AnswerState::locked;
    unanswered += answers == AnswerState::missing;
  }
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
  summary.impossible_steps = jammed + locked;
  summary.worst_overlap = worst_overlap;
  summary.sufficient_time_step = enough_time_step();
}

std::optional<double> Tally::enough_time_step() const {
  if (sufficient_time_step == 0 || jammed > 0 || locked > 0 || passed > 0) return std::nullopt;
  return sufficient_time_step;
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

/// What came and went.
void print_grains(const Terminal& terminal, const Simulation& simulation) {
  for (const InsertReport& insert : simulation.inserted()) {
    terminal.say("insert '{}': {} placed, {:.6g} kg", insert.name,
                 counted(static_cast<std::size_t>(insert.placed), "grain"), insert.mass);
    if (insert.no_room > 0 && insert.waiting == 0)
      terminal.say("insert '{}' had no room for a grain in {}; all that were due have come", insert.name,
                   counted(static_cast<std::size_t>(insert.no_room), "step"));
  }
  for (const RemoveReport& remove : simulation.removed())
    terminal.say("remove '{}': {}{}, {:.6g} kg", remove.name,
                 counted(static_cast<std::size_t>(remove.count), "grain"),
                 remove.material.empty() ? "" : fmt::format(" of '{}'", remove.material), remove.mass);
}

/// Overlaps are a matter of the time step alone, and where walls close on grains nothing of that helps.
std::string remedy_of_misses(const io::Summary& summary) {
  const std::int64_t others = summary.unconverged_steps - summary.impossible_steps;
  std::string remedy;
  if (others > 0) remedy = "Raise solver.max_iterations, reduce time_step";
  if (summary.impossible_steps == 0 && others == summary.overlapping_steps) remedy = "Reduce time_step";
  if (summary.impossible_steps > 0)
    remedy += fmt::format(
        "{} sweeps or a shorter time_step do not mend the {} in which walls close on grains: give these room",
        remedy.empty() ? "More" : "; more", summary.impossible_steps);
  if (summary.exit_code == exit_tolerance_missed) remedy += ", or accept them with allow_unconverged = true";
  return remedy;
}

}  // namespace

std::string note_of_direct_solves(const Simulation& simulation, const Tally& tally, double seconds) {
  const bool most = tally.small > seconds && tally.small > DirectSolveCost{}.part * tally.lately;
  if (simulation.setup().solver.direct_bodies == 0 || !most) return "";
  return fmt::format(
      "direct solves of small clusters, which show how far their velocities and forces are off, took {:.3g} "
      "of the {:.3g} s of the iterations; solver.direct_bodies = 0 leaves that to estimates "
      "(docs/certificate.md)",
      tally.small, tally.lately);
}

void print_notes(const Terminal& terminal, const Simulation& simulation, const Tally& tally) {
  print_grains(terminal, simulation);
  const MessageCount& messages = simulation.messages();
  if (messages.messages > 0)
    terminal.say(
        "an exchange: {} messages of {} bytes between subdomains, {} of {} between ranks; "
        "waiting for them took {:.1f} % of the iterations on rank 0",
        messages.messages, messages.bytes, messages.between_ranks, messages.bytes_between_ranks,
        tally.iterating > 0 ? 100 * tally.exposed / tally.iterating : 0.0);
  if (const std::string note = note_of_direct_solves(simulation, tally, DirectSolveCost{}.at_end);
      !note.empty())
    terminal.say("{}", note);
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
        "change in them in a step, with friction of the largest wall force if that is less, at worst{} "
        "(`velocity_error` in steps.csv){}",
        summary.worst_velocity_error,
        summary.worst_velocity_error < CertificateThresholds{}.all_wrong ? ""
                                                                         : ": there nothing is known of them",
        solver.velocity_tolerance > 0
            ? ""
            : "; with friction the estimate is often ten times too large, and no step is swept longer for "
              "it: solver.velocity_tolerance, where it is set, bounds it");
  terminal.say("results in {}", directory);
}

}  // namespace talus
