#pragma once

/// The one place that says whether a step is solved. Two things are asked of it: that each contact satisfies
/// the law, by the norm of the natural map's residuals (docs/decisions/0003-certificate.md), and that the
/// forces carry what they must, which no contact can see alone (0012-stiff.md, 0014-velocity-error.md).

#include <cstdint>
#include <functional>
#include <vector>

#include "kernels/clusters/answer_state.hpp"
#include "kernels/clusters/clusters.hpp"
#include "kernels/global/admm.hpp"
#include "kernels/global/balance.hpp"
#include "runtime/step/check_sums.hpp"
#include "runtime/step/error_history.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/velocity_error_memory.hpp"
#include "runtime/step/worst_errors.hpp"

namespace talus {

/// How the iterations of a step ended.
struct IterationResult {
  int iterations = 0;  ///< sweeps
  double error_rms = 0, error_max = 0;
  double error_quantile = 0;  ///< where it has a tolerance: Residuals, SolverSettings::quantile of them
  double jump = 0;  ///< of the copies at the end of the last sweep, over their velocities, kinetic norms
  double drift =
      0;  ///< relative change of the wall impulses over the second half of the sweeps, or since ADMM
  double unbalance = 0;  ///< estimate of the relative error of the forces: Certificate::balanced
  /// Estimate of the relative error of velocities in large clusters, on which the verdict depends; 0 where
  /// the step ended before it was asked for.
  double velocity_error = 0;
  double velocity_claim = 0;  ///< what is told of it: with friction it may be more (Certificate::claim)
  BodyAdmmResult stiff;       ///< of the last call of ADMM in this step
  int stiff_calls = 0;
  int corrections = 0;  ///< times that small clusters were put right
  std::int64_t contacts = 0, active = 0;
  bool converged = false;
  bool diverged = false;   ///< the error grows without bound
  bool stagnated = false;  ///< more sweeps would not have made the error smaller
  /// Of small clusters: what speaks most against an answer of one; as long as others can be put right, no
  /// more than that it is missing.
  AnswerState answers = AnswerState::found;
  WorstErrors worst;  ///< where it did not converge
};

/// Every number that a verdict depends on, besides the tolerances that the user sets (SolverSettings).
/// Counts are of sweeps; ratios have no unit.
struct CertificateThresholds {
  /// Plain sweeps diverge when they make the residual of the step's first check so many times larger, > 1. A
  /// plain sweep never does that; an exchange that adds up too much does.
  double divergence = 1e3;
  /// Stagnation is not spoken of before so many sweeps, >= 4.
  int patience = 1000;
  /// The best error of the second half of the sweeps, over that of the quarter before it, above which they
  /// stagnate, in (0, 1]. Plain sweeps, the slowest, take a third off in as many.
  double stagnation = 0.95;
  /// At the first check nothing tells how the change of the wall forces goes on: it counts so many times, >=
  /// 1. Where a few sweeps follow warm impulses in a pile, up to six times as much is still to come (`talus
  /// study stability`, time-step-pile).
  double first_drift = 4;
  /// In large clusters velocities are checked in problems of at most so many contacts, >= 0, whatever they
  /// need.
  std::int64_t tiny = 64;
  /// Which clusters are checked by a direct solve in every step.
  SmallClusters small;
  /// To the tolerance on the balance, but not below this, > 0: rounding of the direct solve may hide what is
  /// less. Where less is asked for, the checks of large clusters look at all of them, too.
  double finest_direct = 1e-6;
  /// Where forces fade away, velocities that rounding makes pass, but not a tolerance below this, > 0: what
  /// is asked for there is less than rounding, and the step says that it was not reached.
  double finest_rounding = 1e-10;
  /// In larger ones, where at least so many sweeps are needed, > 0: about what a velocity check costs.
  double velocity_check_cost = 100;
  /// And at least so many plain sweeps per contact, >= 0: that is stiff for a problem of its size.
  double stiff_per_contact = 0.1;
  /// Elsewhere too, where the work of the contacts' errors leaves it in doubt (VelocityErrorMemory) and so
  /// many sweeps of this step have not mended that, > 0; again when they have grown by the factor, > 1.
  int doubtful = 400;
  double doubt_again = 2;
  /// An estimate of the error of velocities that says no more than that nothing is known of them, > 0.
  double all_wrong = 1;
  /// Part of the impulse at the most pressed wall, in (0, 1), that grains exchange at least.
  double interest = BalanceThresholds{}.interest;
  /// Behind ADMM sweeps still mend much: no check of the whole problem before so many, >= 0.
  int settling = 50;
  /// From this part of the energy that all contacts exchange on, in (0, 1), what small clusters exchange
  /// hides what large ones do.
  double hiding = 0.1;
  /// Small clusters are put right so often in a step, at most, >= 0: sweeps for others may carry them off
  /// again.
  int most_corrections = 10;
  /// So often small clusters may be found to have no answer, >= 1: from then on they are asked again when the
  /// sweeps done have grown by the second factor, > 1.
  int most_doubts = 1;
  double doubt_growth = 4;
  /// Without sweeps in between only where the error has fallen to this part, in (0, 1).
  double correction_gain = 0.5;
  /// A check of the whole problem tells nothing apart below this part of the tolerance on the balance, in (0,
  /// 1).
  double velocity_resolution = 0.2;
  /// It is repeated when the sweeps done have grown by this factor, > 1, if the residual has not fallen far
  /// enough before to promise a balance within the tolerance.
  double velocity_check_growth = 1.25;
};

/// Of small clusters, the worst.
struct SmallError {
  double relative = 0;  ///< distance of what the impulses of the last check give from an answer
  /// Of those that are wrong by more than what was asked for: what speaks most against an answer of one.
  AnswerState worst = AnswerState::found;
  bool mends = false;   ///< of these some can be put right
  Exchanged exchanged;  ///< by the contacts of small clusters that nothing else is asked of
};

/// Answers about the problem as a whole. Each costs about as much as ten to a hundred sweeps, and is asked
/// for where a verdict depends on it only. Collective: all ranks ask in the same order.
class WholeProblem {
 public:
  virtual ~WholeProblem() = default;
  /// About the number of plain sweeps that the step's problem takes.
  virtual double plain_sweeps_needed() = 0;
  /// How many plain sweeps one of the present sweeps is worth.
  virtual double speed() const = 0;
  /// There are clusters of contacts small enough for a direct solve; others.
  virtual bool small_clusters() = 0;
  virtual bool large_clusters() = 0;
  virtual bool several_large_clusters() = 0;
  /// Relative error of what the impulses of the last check give; what is below `enough` is not told apart. Of
  /// the worst small cluster, in velocities and forces (kernels/clusters/step_error.hpp); of the large ones,
  /// in velocities (balance.hpp).
  /// What small clusters may cost grows with `sweeps`, done in this step.
  virtual SmallError small_error(double enough, int sweeps) = 0;
  virtual double large_error(double enough) = 0;
  /// Of large clusters, the relative work of the contacts' errors where it is largest
  /// (kernels/clusters/cluster_work.hpp). Grains are at least so fast [m/s], and get at least such a part of
  /// what presses a wall.
  virtual double large_work(double speed, double interest) = 0;
  /// What is known of the errors of velocities in large clusters from earlier checks of them.
  virtual VelocityErrorMemory& velocity_errors() = 0;
  /// The residual that a share `part` of all contacts does not exceed (kernels/global/residuals.hpp).
  virtual double quantile_error(double part) = 0;
  virtual WorstErrors worst_errors() = 0;

  double sweeps_needed() { return plain_sweeps_needed() / speed(); }
};

enum class Verdict {
  go_on,
  solved,      ///< converged
  diverged,    ///< the error grows without bound
  not_finite,  ///< sweeping on cannot mend a NaN; the step's end reports it
  exhausted,   ///< max_iterations are done
  impossible,  ///< there is no solution, or friction may lock and none was found
  stagnated,   ///< more sweeps would not make the error smaller
  stuck,       ///< likewise, but the method has another way
};

/// The checks of a step and what they say:
///
///   certificate.begin(scales);
///   per check:      verdict = certificate.judge(sums, check, whole)
///   behind ADMM:    certificate.solved_by_admm(result)
///   after the step: certified(certificate.result(), ...)
class Certificate {
 public:
  /// Sizes of a step that residuals and changes are compared with.
  struct Scales {
    double rounding_velocity = 0;  ///< that rounding makes in gaps, over a step [m/s]
    /// Per wall, then per half of a periodic cell: the impulse that it is pushed with [N s].
    std::vector<double> wall_pushes = {};
    std::vector<double> wall_inv_masses = {};  ///< like these [1/kg]; 0: it is driven or fixed
    double drive = 0;                          ///< the largest speed of a driven wall [m/s]
    bool friction = false;                     ///< a coefficient is > 0
  };
  struct Check {
    int iterations = 0;       ///< sweeps done
    double seconds = 0;       ///< since the step's iterations began
    bool plain = true;        ///< sweeps are plain Gauss-Seidel
    bool other_ways = false;  ///< the method has another way when they stagnate
    bool corrects = false;    ///< it puts small clusters right where their answers are known
  };

  /// `settings` is kept as a reference.
  explicit Certificate(const SolverSettings& settings, const CertificateThresholds& thresholds = {})
      : settings_(settings), thresholds_(thresholds) {}
  /// Settings that end with the statement would be asked later.
  explicit Certificate(SolverSettings&&, const CertificateThresholds& = {}) = delete;

  void begin(Scales scales);
  Verdict judge(const CheckSums& sums, const Check& check, WholeProblem& whole);
  /// Whether the forces that walls and heavy bodies get are right within balance_tolerance: by the drift of
  /// the wall forces, which sweeps show; or by a velocity check, which decides by itself. Collective.
  bool balanced(WholeProblem& whole);
  /// This step's velocities are checked as a whole: where that costs less than the sweeps that it may save,
  /// in problems that are stiff for their size; and in tiny ones. Collective.
  bool checks_velocities(WholeProblem& whole) const;
  /// A check in this step has found the velocities of large clusters wrong, though their stiffness promised
  /// better.
  bool found_wrong() const { return asked_error_ > velocity_tolerance(); }
  /// More plain sweeps than a problem of so many contacts should take.
  double stiff_for(std::int64_t contacts) const {
    return thresholds_.stiff_per_contact * static_cast<double>(contacts);
  }

  /// The last check has found small clusters in error, and putting them right may help.
  bool correctable() const;
  /// They were: what follows is a new start.
  void corrected();
  SmallClusters small_clusters() const { return thresholds_.small.within(settings_.direct_bodies); }
  /// The checks of large clusters look at the small ones, too.
  bool looks_twice() const { return settings_.balance_tolerance < thresholds_.finest_direct; }
  /// On the balance of small clusters.
  double small_tolerance() const { return std::max(settings_.balance_tolerance, thresholds_.finest_direct); }

  /// The impulses of the last check were replaced by those of ADMM.
  void solved_by_admm(const BodyAdmmResult& result);
  /// Sweeps become plain: what those before have made worse is not held against them.
  void forgive();
  /// Stagnation counts from here.
  void be_patient() { history_.be_patient(); }

  const IterationResult& result() const { return result_; }
  const ErrorHistory& history() const { return history_; }
  /// Per wall, at the last check [N s].
  const std::vector<Vec3>& wall_impulses() const { return wall_impulses_.back(); }
  /// Sweeps done when those that count began: ADMM is a new start.
  int started_at() const {
    return result_.stiff_calls + result_.corrections == 0 ? 0 : history_[history_.start()].iterations;
  }

 private:
  Verdict verdict_on(const CheckSums& sums, const Check& check, WholeProblem& whole);
  void measure(const CheckSums& sums);
  double velocity_tolerance() const { return settings_.velocity_allowed(scales_.friction); }
  /// Energy that large clusters exchange [J]: with their own motion, and what it counts as at least.
  struct LargeEnergy {
    double moved = 0, least = 0;
    double counts() const { return std::max(moved, least); }
  };
  LargeEnergy exchanged_by_large() const;
  bool small_hide_large(WholeProblem& whole) const;
  double relative_work(WholeProblem& whole);
  double drift() const;
  double wall_scale() const;
  double largest_change(std::size_t from, std::size_t to) const;

  const SolverSettings& settings_;
  CertificateThresholds thresholds_;
  Scales scales_;
  IterationResult result_;
  ErrorHistory history_;
  std::vector<std::vector<Vec3>> wall_impulses_;  ///< like the history: per wall [N s]
  double residual2_ = 0;                          ///< at the last check [m^2/s^2]
  double scale2_ = 0;                             ///< what it is compared with [m^2/s^2]
  /// Likewise: the work of the contacts' errors [J]; what contacts exchange, and of that those of small
  /// clusters, as of the last answer about them; velocities that rounding makes pass [m/s].
  double work_ = 0;
  Exchanged exchanged_, exchanged_by_small_;
  bool small_known_ = false;  ///< there was such an answer in this step
  double rounding_ = 0;
  /// Of the first check of the step, or the first since ADMM, or since sweeps became plain [m^2/s^2].
  double first_residual2_ = 0;
  /// The last answer about the whole problem.
  struct WholeCheck {
    int at = -1;  ///< sweeps then; -1: none in this step, or since a new start
    double error_rms = 0, error = 0;
  };
  double repeated(WholeCheck& then, double tolerance, const std::function<double(double)>& ask);
  bool even(WholeProblem& whole);
  double small_unbalance(WholeProblem& whole);
  double large_unbalance(WholeProblem& whole);
  void claim(double error, WholeProblem& whole);
  double exchanged_over_walls() const;
  bool large_ask_for_more(WholeProblem& whole);
  double drifting(WholeProblem& whole);
  /// Relative error of velocities by the work of the contacts' errors.
  struct WorkEstimate {
    double error;
    bool known;  ///< it does; else a check of the velocities has to say
  };
  WorkEstimate estimate_by_work(WholeProblem& whole);
  double by_work(WholeProblem& whole);

  WholeCheck small_check_, large_check_, quantile_check_;
  bool mends_ = false;         ///< the last answer about small clusters can put some of them right
  double corrected_from_ = 0;  ///< error before small clusters were last put right in this step
  int corrected_at_ = -1;      ///< sweeps done then
  int asked_at_ = 0;           ///< sweeps done in this step when by_work last asked for a check of velocities
  double asked_error_ = 0;     ///< what that found
  int work_at_ = -1;           ///< sweeps done when the work in several large clusters was last asked for
  double largest_work_ = 0;    ///< relative: what that found
  int doubts_ = 0;             ///< times in this step that no answer was found
  int doubted_at_ = 0;         ///< sweeps done when that was so last
};

/// Whether a step whose iterations ended so is to be believed. `momentum_defect`: what the sample gained
/// beside what walls and weight gave, relative; `passed`: pairs of bodies that went through one another;
/// `overlap`: the largest that the run has made, over the smaller radius (runtime/step/overlap.hpp).
bool certified(const IterationResult& result, double momentum_defect, std::int64_t passed, double overlap,
               const SolverSettings& settings);

}  // namespace talus
