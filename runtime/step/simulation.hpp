#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/communicator.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/step/checkpoint.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/population.hpp"
#include "runtime/step/runaway.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/solver_loop.hpp"
#include "runtime/step/stage_end.hpp"
#include "runtime/step/state.hpp"
#include "runtime/step/step_graph.hpp"
#include "runtime/step/time_step.hpp"

namespace talus {

/// State from which a simulation continues between two steps, of one subdomain on one rank. Present loads and
/// velocities of the walls are in `walls`; the impulses of the last step, if there was one, in `candidates`.
struct SavedState {
  Bodies bodies;
  std::vector<Wall> walls;
  Candidates candidates;
  StepReport report;
  std::size_t stage_index = 0;
  std::int64_t steps_of_stage = 0;
  Vec3 lengths_of_box = Vec3::Zero();                            ///< at the beginning of the stage [m]
  std::optional<std::vector<GivenOverlap>> given_overlaps = {};  ///< of StepState
  StageClock clock = {};                                         ///< of a stage that chooses its time steps
  double sheared = 0;                                            ///< path of the cell's shear in the stage
  double held = 0;                        ///< time for which the stage's bound on equilibrium has held [s]
  std::vector<double> stage_begins = {};  ///< times of the run at which this stage and those before began [s]
  PopulationState population = {};
  Domain domain = {};
  CellFlow flow = {};
  StageMemory memory = {};
  double falls_in = 0;  ///< fall_time of the last step where `held` is not 0 [s]
};

/// A simulation: stages of time steps, each step one graph of tasks (docs/theory.md, "One time
/// step").
///
///   Executor executor({.threads = 2});
///   Simulation simulation(setup, std::move(bodies), executor);
///   while (!simulation.finished()) {
///     const StepReport& report = simulation.step();
///     if (wanted(report.step))
///       executor.submit_background("output", [frame = simulation.frame()] { write(frame); });
///     simulation.begin_next_stage();
///   }
///
/// On several ranks all call the same functions; those marked collective must be called by all. With the same
/// subdomains, results depend neither on the number of threads nor on that of ranks (step_graph.hpp).
class Simulation {
 public:
  /// Throws std::invalid_argument when the setup makes no sense, on all ranks. Each rank
  /// passes the bodies it has, any part of all (dealing.hpp); the first step deals them out. Executor and
  /// ranks must outlive the simulation. Collective.
  Simulation(Setup setup, Bodies bodies, graph::Executor& executor, const graph::Communicator& ranks);
  /// The same on one rank.
  Simulation(Setup setup, Bodies bodies, graph::Executor& executor);
  /// Goes on from a saved state, on one rank. Walls, stages and grains are those of the simulation that was
  /// saved; solver, subdomains and threads need not be: so one step can be solved in many ways. The next step
  /// finds its candidates anew.
  Simulation(Setup setup, const SavedState& from, graph::Executor& executor);
  /// Continues from a checkpoint with the bits of the run that wrote it, on any number of ranks up to that of
  /// subdomains. `setup` is that of the run, with the walls placed as at first; loads and ends of stages may
  /// be others. Throws std::invalid_argument when it does not fit. Collective.
  Simulation(Setup setup, const Checkpoint& from, graph::Executor& executor,
             const graph::Communicator& ranks);
  ~Simulation();

  /// To be called before the first step: contacts between the bodies named start from these forces. Each rank
  /// passes any part of all. Collective.
  void begin_from(std::vector<GivenForce> forces);
  /// Makes steps follow a recorded order, see StepGraph::follow.
  void follow(trace::Order* order);
  /// Does one time step. Collective. Throws RunawayError, or graph::TaskError when a task failed. Not to be
  /// called when finished.
  const StepReport& step();

  /// After a step, and after its results were read: goes to the next stage when this one has ended (true), or
  /// finishes.
  bool begin_next_stage();

  /// The state after the last step and begin_next_stage(). Throws std::logic_error with several subdomains.
  SavedState save() const;

  /// The whole run after the last step and begin_next_stage(); at least one step is done. Each rank gets the
  /// parts of its subdomains.
  Checkpoint checkpoint() const;

  bool finished() const;
  /// Part of the current stage that is done, in [0, 1], by its nearest end condition.
  double stage_fraction() const;
  /// That condition, when the stage has ended: "steps", "time", "strain" or "equilibrium"; else "".
  const char* end_reached() const;
  const Stage& stage() const;
  std::size_t stage_index() const;
  std::int64_t steps_of_stage() const;

  const Setup& setup() const;
  const StepState& state() const;
  const StepParameters& parameters() const;
  const std::vector<ErrorCheck>& error_history() const;
  const StepReport& report() const;
  /// How the last step's iterations ended.
  const IterationResult& iterations() const;
  /// What the last step's tasks summed up: sums over bodies and contacts, times of the parts.
  const StepSums& sums() const;
  const graph::Graph& step_graph() const;

  /// Walls after the last step: positions, velocities, forces.
  std::vector<WallReport> walls() const;
  /// Sums over the walls of each group, after a step: forces, torques about the group's point, work.
  std::vector<WallReport> groups() const;
  /// Bodies that the setup names, after the last step: those that are still there.
  const std::vector<BodyReport>& named_bodies() const;
  /// What insertions and removals have done so far; empty without any.
  std::vector<InsertReport> inserted() const;
  std::vector<RemoveReport> removed() const;
  /// Probes that were due after the last step; empty without any.
  const std::vector<ProbeReport>& probes() const;
  /// Strains and stresses after the last step; empty when the walls do not close a box. Collective.
  std::optional<TriaxialReport> triaxial() const;
  /// Report of a periodic cell after the last step. Collective.
  std::optional<CellReport> cell() const;
  /// A copy of what output needs, in order of id; contacts with r_n > 0 only, `contacts` false leaves them
  /// out. Collective; each rank gets its part (frame.hpp).
  Frame frame(bool contacts = true) const;
  /// Gives back the memory that only steps use, some 250 bytes a grain; the next step takes it anew. Worth it
  /// before frame() and checkpoint() of large samples, which are as large. Biases of contacts and velocities
  /// without contacts are gone then from state().
  void release_room();

  /// talus::digest of all bodies. Collective.
  std::uint64_t digest() const;
  std::int64_t bodies() const;  ///< of all ranks
  /// What one iteration sends, as planned with the last candidates.
  const MessageCount& messages() const;
  /// Time that this rank's tasks waited for messages in the last step [s].
  double exposed() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> impl_;
};

}  // namespace talus
