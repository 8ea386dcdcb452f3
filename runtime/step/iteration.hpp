#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kernels/sweeps/momentum.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/step/admm.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// How the iterations of a step ended.
struct IterationResult {
  int iterations = 0;  ///< sweeps
  double error_rms = 0, error_max = 0;
  double jump = 0;  ///< of the copies at the end of the last sweep, over their velocities, kinetic norms
  double drift =
      0;  ///< relative change of the wall impulses over the second half of the sweeps, or since ADMM
  double unbalance = 0;  ///< estimate of the relative error of the forces: Iteration::balanced
  BodyAdmmResult stiff;  ///< of the last call of ADMM in this step
  int stiff_calls = 0;
  std::int64_t contacts = 0, active = 0;
  bool converged = false;
  bool diverged = false;   ///< the error grows without bound
  bool stagnated = false;  ///< more sweeps would not have made the error smaller
};

/// What `automatic` means on these ranks: the strongest set that all of them run, since they shall round
/// alike. Any other set as it is. Collective.
InstructionSet settled(InstructionSet set, const graph::Communicator& ranks);

/// The iteration part of a step as a program on the chunk graph: every epoch, each chunk does one thing, in
/// the order of its colour.
///
///   epoch   s            s+1               s+2 ... s+1+n   s+2+n        s+3+n
///           accumulate   measure -> gate   n sweeps        accumulate   measure -> gate ...
///
/// `accumulate` makes V afresh from r, so that the error is never that of a drifted V and the step ends on
/// what was certified. At a gate one thread adds the chunks' sums in order, by subdomain, and decides whether
/// to go on, and for how many sweeps n: to where the tolerance is expected to be met.
///
/// With several ranks the sums travel while the next sweep goes on (a non-blocking reduction): they are read
/// at a gate behind that sweep. If they say that the step was solved, `restore` brings back the impulses that
/// were certified, so that results are the bits of one rank, where nothing has to be waited for.
///
/// Where ADMM is called, it is by the gate's threads of all ranks, on the impulses that were certified: the
/// next epoch is `accumulate`.
///
/// Nodes 0..k-1 are the chunks; where something is to be glued (gluing.hpp), publish of every subdomain, the
/// root, and glue of every subdomain follow, take of every one whose subdomain colour is not the first, and
/// tell. The order in a subdomain is chunks at glued walls, tell, those at the border, publish, those inside,
/// which hide the messages; in a later subdomain colour the inside comes before take, the border and publish.
class Iteration {
 public:
  /// References are kept. `state.contacts` holds the narrow phase's contacts.
  Iteration(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
            const DecompositionSettings& decomposition, const graph::Communicator& ranks);

  void node(std::uint32_t node, int epoch);
  bool gate(int epoch) const {
    return epoch == segment_ + 1 || epoch == read_at_ || epoch == restore_at_ ||
           (work(epoch) == Work::sweep && course(epoch).method == SolverMethod::nncg);
  }
  bool decide(int epoch);
  /// The decision behind this epoch waits for the sums of all ranks, however many there are.
  bool settles(int epoch) const {
    return work(epoch) == Work::measure && sweeps_ >= settings_.max_iterations;
  }
  /// Of threads that wait for decide(): ADMM's subdomains are shared out.
  void assist() { admm_.assist(); }
  /// What a node does in an epoch, as a trace names it; none for gluing where nothing is glued.
  std::optional<trace::Kind> kind(std::uint32_t node, int epoch) const;

  /// Subdomain here that the node works on; none: the root.
  std::optional<std::size_t> subdomain_of(std::uint32_t node) const;
  /// Brings all that the loop reads and writes of a subdomain here into the cache of the core that calls.
  void fetch(std::size_t subdomain) const;

  /// Before the first epoch of a step: copies and sums fitted to the contacts found. Collective.
  void begin();

  /// Collective, after the candidates were distributed.
  void plan();
  /// Collective, behind plan() and the first narrow phase, before begin().
  void plan_tree();

  const Gluing& gluing() const { return gluing_; }
  const SweepKernels& kernels() const { return kernels_; }
  const IterationResult& result() const { return result_; }
  /// Contacts of the fullest subdomain over the mean one, less 1, at the last check.
  double imbalance() const { return imbalance_; }
  /// Per subdomain here, with BalanceBy::time: time of its chunks since the plan [s].
  std::vector<double> busy() const;
  /// error_rms at each check, with the sweeps done and the time that they and the checks took since the
  /// iterations of the step began.
  struct Check {
    int iterations;
    double error_rms;
    double seconds;
  };
  const std::vector<Check>& history() const { return history_; }

 private:
  /// Between two checks at least: one costs about 1.5 of them. Two, so that what several ranks learn of a
  /// check behind the first sweep, and what it changes there, comes before the last one.
  static constexpr int least_sweeps = 2;
  enum class Work { accumulate, measure, sweep, restore };
  Work work(int epoch) const {
    return epoch == restore_at_ ? Work::restore
           : epoch < segment_   ? Work::sweep
           : epoch == segment_  ? Work::accumulate
                                : Work::measure;
  }
  Gluing::Mode gluing_mode(int epoch) const;
  template <bool Friction>
  void chunk(std::size_t c, int epoch);
  template <bool Friction>
  void sweep(std::size_t c, ContactRange range, double mu, int epoch);
  std::span<const Slot> owned(std::size_t c) const;
  void carry_on(std::size_t c, ContactRange range, int epoch);
  void take(std::size_t e, int epoch);
  bool single(int epoch) const { return work(epoch) == Work::sweep && course(epoch).single; }
  void change_precision(std::size_t c, ContactRange range, int epoch);
  /// How sweeps are carried on; sweeps are counted from 0.
  struct Course {
    SolverMethod method = SolverMethod::nlgs;  ///< never automatic
    int from = 0;                              ///< its first sweep
    int begun = 0;        ///< the sweep with which its momentum began: `from`, or one in single precision
    double most = 0;      ///< of beta, with momentum, or when it is taken up again
    bool single = false;  ///< in single precision
  };
  /// Of the sweep in this epoch. A course that a check calls for begins behind the sweep that may have been
  /// made since.
  const Course& course(int epoch) const { return number(epoch) >= course_.from ? course_ : course_before_; }
  int number(int epoch) const { return before_segment_ + epoch - sweeps_from_; }
  double beta(int epoch) const;
  double omega(int epoch) const;
  bool stagnant() const;
  void first_course();
  void begin_course(SolverMethod method, double most);
  void give_way();
  bool single_will_do(SolverMethod method) const;
  void go_on_in_double();
  bool measured(int epoch);
  bool swept(int epoch);
  std::vector<double> rows_of_subdomains() const;
  void add_up(std::span<const double> rows);
  bool judge();
  void choose_course();
  const Check* check_before() const;
  int started_at() const;
  int sweeps_ahead() const;
  void plan_sweeps(int epoch, int sweeps);
  void turn_conjugate();
  double impulse_scale() const;
  double drift() const;
  double sweeps_needed();
  std::vector<double> carrying_walls() const;
  bool stiffness_holds() const;
  /// No grain is much heavier than another: none would change everything where it lands.
  bool alike() const { return spread_ < 1000; }
  bool looks_at_all();
  bool balanced();
  bool ask_admm();
  void call_admm(int epoch);

  StepState& state_;
  const StepParameters& parameters_;
  const SolverSettings& settings_;
  const DecompositionSettings& decomposition_;
  const graph::Communicator& ranks_;
  SweepKernels kernels_;
  Gluing gluing_;
  Admm admm_;
  std::vector<ErrorSums> sums_;              ///< per chunk
  std::vector<std::vector<Vec3>> impulses_;  ///< per check: impulse of every wall [N s]
  std::vector<Check> history_;
  IterationResult result_;
  std::vector<double> busy_;  ///< per chunk [s]; empty unless asked for
  double imbalance_ = 0;
  ErrorSums total_;                          ///< of all subdomains, at the last check
  JumpSums jump_;                            ///< likewise
  std::vector<std::vector<double>> before_;  ///< Schwarz: per chunk at the interface, impulses before a sweep
  AccelerationHistory acceleration_;         ///< empty with plain NLGS
  std::vector<double> changes_;              ///< NNCG: per chunk, what the last sweep changed [J]
  double change2_ = 0;                       ///< NNCG: of all, at the sweep before
  double conjugate_beta_ = 0;                ///< NNCG: of the next sweep
  double began_ = 0, measured_ = 0;  ///< clock at begin() and at the last check [s], for history_ only
  /// At the first check of the step, or the first since ADMM, or since momentum gave way [m^2/s^2].
  double first_residual2_ = 0;
  std::size_t history_from_ = 0;   ///< that check
  std::size_t patience_from_ = 0;  ///< the check since which plain sweeps have their subdomain colour
  double sweeps_needed_ = -1;      ///< of plain NLGS, as ADMM sees the problem; < 0: not asked in this step
  /// The last answer to that, and the problem it was given for. It holds for later steps on the same
  /// candidates where the problem was far from stiff and is still much the same.
  struct Stiffness {
    double sweeps_needed = -1;
    std::int64_t contacts = 0;
    std::vector<double> carrying;  ///< per wall 1/M [1/kg] where it carries, else -1
    int renewals = 0;              ///< of the candidates since
  };
  Stiffness stiffness_;
  double spread_ = 1;                 ///< the heaviest grain over the lightest
  double candidates_everywhere_ = 0;  ///< of all ranks
  /// The last look at the error of all velocities.
  struct Look {
    int at = -1;  ///< sweeps then; -1: none in this step, or since ADMM
    double error_rms = 0, error = 0;
  };
  Look looked_;
  std::unique_ptr<graph::PendingGather> pending_;
  // Written at gates only, when every thread waits:
  int sweeps_from_ = 0;     ///< epoch of the first sweep of the segment
  int segment_ = 0;         ///< epoch of the next accumulate
  int read_at_ = -1;        ///< epoch behind which the sums of the last check are read
  int restore_at_ = -1;     ///< epoch that ends a step whose sums came behind a sweep
  int sweeps_ = 0;          ///< done when `segment_` is reached
  int before_segment_ = 0;  ///< done when it began
  Course course_, course_before_;
};

}  // namespace talus
