#pragma once

/// What `talus run` says on stderr, by rank 0 alone.

#include <cstddef>
#include <cstdint>
#include <string>

#include "io/results/run_json.hpp"
#include "io/scene/scene.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

/// What the steps of a run came to, taken together.
struct Tally {
  std::int64_t unconverged = 0;
  std::int64_t passed = 0;     ///< pairs that went through one another
  std::int64_t stagnated = 0;  ///< steps
  double floor = 0;            ///< worst error at which a step stood still
  std::int64_t iterations = 0;
  double worst_error = 0;
  double worst_balance = 0;
  double worst_penetration = 0;       ///< [smallest radius]
  double exposed = 0, iterating = 0;  ///< [s] waited for messages; in the iterations

  /// A step that is done.
  void add(const Simulation& simulation);
  /// Fills in steps, iterations and worst errors; `last` is the report of the last step.
  void sum_up(const StepReport& last, io::Summary& summary) const;
};

/// "1 step", "2 steps".
std::string counted(std::size_t count, const char* what);

/// "2000 grains, 6 walls, 3 stages".
std::string contents(const io::Scene& scene, std::size_t grains);

/// Contents, ranks, threads and subdomains of a run that begins.
void print_start(const io::Scene& scene, std::size_t grains, int threads, const graph::Communicator& ranks);

/// Which of its conditions a stage has come to, and how far it was from rest where that was one.
void print_stage_end(const Simulation& simulation);

/// Messages of an exchange, and warnings of steps that grains passed through one another in, or whose error
/// stood still.
void print_notes(const Simulation& simulation, const Tally& tally);

/// What came of the run, of which the results are in `directory`.
void print_end(const io::Summary& summary, const SolverSettings& solver, const std::string& directory);

}  // namespace talus
