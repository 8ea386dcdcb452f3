#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/graph/loop_plan.hpp"
#include "runtime/step/certificate.hpp"
#include "runtime/step/chunk_work.hpp"
#include "runtime/step/courses.hpp"
#include "runtime/step/epoch_schedule.hpp"
#include "runtime/step/fetch_subdomain.hpp"
#include "runtime/step/global_solver.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/step/methods/method.hpp"
#include "runtime/step/position_correction.hpp"
#include "runtime/step/present_problem.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Resolves `automatic` to the widest instruction set that all ranks support, since all must round alike.
/// Returns any other set as it is. Collective.
InstructionSet settled(InstructionSet set, const graph::Communicator& ranks);

/// The iterations of a step as a program on the chunk graph (runtime/graph/epoch_loop.hpp): every epoch, each
/// chunk does one thing, in the order of its colour. The parts that decide:
///
///   EpochSchedule   which epoch does what            ChunkWork     what that is for a chunk
///   Certificate     whether the step is solved       Method        how sweeps go on, and when ADMM helps
///   PositionCorrection  after the iterations: sweeps that undo overlaps, where the scene asks for them
///
/// At a gate one thread adds the chunks' sums in order, by subdomain, and asks certificate and method. With
/// several ranks the sums travel while the next sweep goes on (a non-blocking reduction), and are read at a
/// gate after that sweep. Results still have the bits of a run on one rank, which does not wait for sums.
/// ADMM is called at a gate of all ranks, on the impulses that were checked.
///
/// The nodes are those of a graph::LoopPlan whose work is the chunks and whose groups are the subdomains of
/// this rank; where nothing is glued (gluing.hpp) there are chunks only. The order in a subdomain is chunks
/// at glued walls, tell, those at the border, publish, those inside, which hide the messages; in a later
/// subdomain colour the inside comes before take, the border and publish.
class SolverLoop {
 public:
  /// References are kept. `state.contacts` holds the narrow phase's contacts.
  SolverLoop(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
             const DecompositionSettings& decomposition, const graph::Communicator& ranks);

  // The program.
  void node(std::uint32_t node, int epoch);
  bool gate(int epoch) const {
    return schedule_.measures_at(epoch) || schedule_.reads_sums_at(epoch) || schedule_.restores_at(epoch) ||
           schedule_.ends_at(epoch) || conjugate(epoch);
  }
  bool decide(int epoch);
  /// Whether the decision after this epoch waits for the sums of all ranks, however many there are.
  bool settles(int epoch) const {
    return schedule_.measures_at(epoch) && schedule_.planned() >= settings_.max_iterations;
  }
  /// Threads that wait for decide() call this: they take shares of ADMM's subdomains.
  void assist() { global_.assist(); }
  double take_small_seconds() { return global_.take_small_seconds(); }
  /// What a node does in an epoch, as a trace names it; none for gluing where nothing is glued.
  std::optional<trace::Kind> kind(std::uint32_t node, int epoch) const;

  /// Index of the subdomain that the node works on; none for collect and root.
  std::optional<std::size_t> subdomain_of(std::uint32_t node) const;
  /// Brings all that the loop reads and writes of a subdomain into the cache of the core that calls.
  void fetch(std::size_t subdomain) const {
    fetch_subdomain(state_, work_.acceleration(), SubdomainPlace(subdomain));
    gluing_.fetch(SubdomainPlace(subdomain));
  }

  /// Before the first epoch of a step: sizes copies and sums by the contacts found. Collective.
  void begin();
  /// Between steps: gives back the memory that only iterations use.
  void release_room() {
    work_.release_room();
    global_.release_room();
  }

  /// Collective, after the candidates were distributed.
  void plan();
  /// Collective, after plan() and the first narrow phase, before begin().
  void plan_tree();
  /// After plan_tree(): plans the nodes for this number of threads.
  const graph::LoopPlan& plan_nodes(int threads);

  const Gluing& gluing() const { return gluing_; }
  const SweepKernels& kernels() const { return kernels_; }
  const PositionCorrection& positions() const { return positions_; }
  PositionCorrection& positions() { return positions_; }
  const PresentProblem& problem() const { return problem_; }
  PresentProblem& problem() { return problem_; }
  const IterationResult& result() const { return certificate_.result(); }
  /// The checks of the step.
  const std::vector<ErrorCheck>& history() const { return certificate_.history().all(); }
  /// Contacts of the fullest subdomain over the mean one, less 1, at the last check.
  double imbalance() const { return imbalance_; }
  /// Per subdomain here, with BalanceBy::time: time of its chunks since the plan [s].
  std::vector<double> busy() const { return work_.busy(); }

 private:
  bool conjugate(int epoch) const {
    return schedule_.work(epoch) == EpochSchedule::Work::sweep &&
           work_.course(epoch).plan.kind == SweepKind::conjugate;
  }
  bool schwarz() const;
  bool in_single(int epoch) const {
    return work_.single(epoch) || schedule_.work(epoch) == EpochSchedule::Work::position;
  }
  Gluing::Mode gluing_mode(int epoch) const;
  void split_walls();
  bool goes_on(int epoch);
  void settle_cell();
  void take(SubdomainPlace e, int epoch);
  /// False: the velocities of the step are final.
  bool decide_on_velocities(int epoch) {
    if (schedule_.restores_at(epoch)) return false;
    return schedule_.work(epoch) == EpochSchedule::Work::measure ? measured(epoch) : swept(epoch);
  }
  bool measured(int epoch);
  bool swept(int epoch);
  bool judge();
  bool ask_remedy();
  void call_remedy(int epoch);
  void turn_conjugate();
  void begin_course(const SweepPlan& plan, int from);
  bool single_will_do(SweepKind kind) const;
  int sweeps_ahead() const;

  StepState& state_;
  const StepParameters& parameters_;
  const SolverSettings& settings_;
  const DecompositionSettings& decomposition_;
  const graph::Communicator& ranks_;
  SweepKernels kernels_;
  Gluing gluing_;
  GlobalSolver global_;
  EpochSchedule schedule_;  ///< written at gates only, when every thread waits; so are courses_
  Courses courses_;
  ChunkWork work_;
  PositionCorrection positions_;
  Certificate certificate_;
  PresentProblem problem_;
  graph::LoopPlan plan_;
  std::unique_ptr<Method> method_;  ///< of the step
  std::unique_ptr<graph::PendingGather> pending_;
  double imbalance_ = 0;
  bool corrects_ = false;            ///< the remedy asked for last is the Newton step of the check
  double began_ = 0, measured_ = 0;  ///< clock at begin() and at the last check [s], for the history only
};

}  // namespace talus
