#pragma once

/// What `talus run` says, by rank 0 alone.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "apps/shared/terminal.hpp"
#include "io/results/run_json.hpp"
#include "io/scene/scene.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

/// What the steps of a run came to, taken together.
struct Tally {
  std::int64_t unconverged = 0;
  std::int64_t passed = 0;      ///< pairs that went through one another
  std::int64_t stagnated = 0;   ///< steps
  double floor = 0;             ///< worst error at which a step stood still
  std::int64_t jammed = 0;      ///< steps without a solution
  std::int64_t locked = 0;      ///< others, in which friction may hold grains between walls
  std::int64_t unanswered = 0;  ///< others that missed, in which a small cluster has no answer
  std::int64_t iterations = 0;
  double worst_error = 0;
  double worst_balance = 0;
  double worst_velocity = 0;                   ///< of the steps that are certified
  double worst_penetration = 0;                ///< [smallest radius]
  double worst_overlap = 0, last_overlap = 0;  ///< [smaller radius of a pair]: of all steps, of the last
  std::int64_t overlapped = 0;                 ///< steps that ended with an overlap beyond its tolerance
  StepReport deepest;                          ///< of these steps the one with the deepest
  StepReport furthest;  ///< of the steps whose iterations did not converge the one with the worst contact
  double sufficient_time_step = 0;    ///< [s] enough for all overlaps so far; 0: not known
  double exposed = 0, iterating = 0;  ///< [s] waited for messages; in the iterations
  double lately = 0, small = 0;       ///< [s] since the run began or went on: in the iterations; of these for
                                      ///< answers of small clusters

  /// A step that is done.
  void add(const Simulation& simulation);
  /// An overlap is at most the time step times a speed (docs/theory.md, "Gap term and restitution"): the step
  /// that made one would have kept within the tolerance at a time step smaller by as much as it was missed.
  void add_overlap(const Simulation& simulation);
  /// [s] at which overlaps would have stayed within their tolerance; none where that is not known, where
  /// walls close on grains, for which no time step is short enough, or where grains went through one another
  /// or deep into them, which their overlap does not show.
  std::optional<double> enough_time_step() const;
  /// Fills in steps, iterations and worst errors; `last` is the report of the last step.
  void sum_up(const StepReport& last, io::Summary& summary) const;
};

/// "1 step", "2 steps".
std::string counted(std::size_t count, const char* what);

/// "2000 grains, 6 walls, 3 stages".
std::string contents(const io::Scene& scene, std::size_t grains);

/// Contents, ranks, threads and subdomains of a run that begins.
void print_start(const Terminal& terminal, const io::Scene& scene, std::size_t grains, int threads,
                 const graph::Communicator& ranks);

/// Which of its conditions a stage has come to, and how far it was from rest where that was one.
void print_stage_end(const Terminal& terminal, const Simulation& simulation);

/// "body 3", or of a number below 0 "wall 'floor'".
std::string name_of(std::int64_t body, const std::vector<Wall>& walls);
/// "bodies 3 and 17", "body 3 and wall 'floor'".
std::string name_of(const BodyPair& pair, const std::vector<Wall>& walls);

/// Grains that came and went, messages of an exchange, and the time of direct solves.
void print_notes(const Terminal& terminal, const Simulation& simulation, const Tally& tally);

/// When the cost of direct solves is worth a word: more than so many seconds [s], and this part of the
/// iterations. Under way, so that who watches may stop a long run and resume it, or begin anew, without.
struct DirectSolveCost {
  double at_end = 1, under_way = 20;
  double part = 0.5;
};

/// What direct solves of small clusters cost, where that is more than `seconds`; else "".
std::string note_of_direct_solves(const Simulation& simulation, const Tally& tally, double seconds);

/// What came of the run, of which the results are in `directory`.
void print_end(const Terminal& terminal, const io::Summary& summary, const SolverSettings& solver,
               const std::string& directory);

}  // namespace talus
