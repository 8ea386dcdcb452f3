#pragma once

#include <cstdint>
#include <vector>

#include "runtime/step/admm.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// How the iterations of a step ended.
struct IterationResult {
  int iterations = 0;  ///< sweeps
  double error_rms = 0, error_max = 0;
  double jump = 0;       ///< of the copies at the end of the last sweep, over their velocities, kinetic norms
  double unbalance = 0;  ///< estimate of the relative error of the forces on walls and heavy bodies
  AdmmResult stiff;      ///< of the last call of ADMM in this step
  int stiff_calls = 0;
  double drift =
      0;  ///< relative change of the wall impulses over the second half of the iterations, or since ADMM
  std::int64_t contacts = 0, active = 0;
  bool converged = false;
  bool diverged = false;  ///< the error grows without bound
};

/// The iteration part of a step as a program on the chunk graph: every epoch, each chunk does one thing, in
/// the order of its colour.
///
///   epoch   s            s+1               s+2 ... s+1+n   s+2+n        s+3+n
///           accumulate   measure -> gate   n sweeps        accumulate   measure -> gate ...
///
/// `accumulate` makes V afresh from r, so that the error is never that of a drifted V and the step ends on
/// what was certified. At a gate one thread adds the chunks' sums in order, by subdomain, and decides whether
/// to go on; the distance n of the gates grows with the iterations done. Nodes 0..k-1 are the chunks; where
/// something is to be glued (gluing.hpp), publish of every subdomain, the centre, and glue of every subdomain
/// follow. Publish comes after the boundary chunks and before the inner ones, which hide the messages.
class Iteration {
 public:
  /// References are kept. `state.contacts` holds the narrow phase's contacts.
  Iteration(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
            const DecompositionSettings& decomposition, const graph::Communicator& ranks);

  void node(std::uint32_t node, int epoch);
  bool gate(int epoch) const { return epoch == segment_ + 1; }
  bool decide(int epoch);

  /// Before the first epoch of a step: copies and sums fitted to the contacts found. Collective.
  void begin();

  Gluing& gluing() { return gluing_; }
  const Gluing& gluing() const { return gluing_; }
  const IterationResult& result() const { return result_; }
  /// error_rms at each check, with the sweeps done.
  struct Check {
    int iterations;
    double error_rms;
  };
  const std::vector<Check>& history() const { return history_; }

 private:
  enum class Work { accumulate, measure, sweep };
  Work work(int epoch) const {
    return epoch < segment_ ? Work::sweep : epoch == segment_ ? Work::accumulate : Work::measure;
  }
  Gluing::Mode gluing_mode(int epoch) const;
  template <bool Friction>
  void chunk(std::size_t c, Work work);
  template <bool Friction>
  void sweep(std::size_t c, ContactRange range, double mu);
  void add_up();
  double impulse_scale() const;
  double drift() const;
  double sweeps_needed();
  bool balanced();
  bool ask_admm();

  StepState& state_;
  const StepParameters& parameters_;
  const SolverSettings& settings_;
  const DecompositionSettings& decomposition_;
  const graph::Communicator& ranks_;
  Gluing gluing_;
  Admm admm_;
  std::vector<ErrorSums> sums_;              ///< per chunk
  std::vector<std::vector<Vec3>> impulses_;  ///< per check: impulse of every wall [N s]
  std::vector<Check> history_;
  IterationResult result_;
  ErrorSums total_;                          ///< of all subdomains, at the last check
  JumpSums jump_;                            ///< likewise
  std::vector<std::vector<double>> before_;  ///< Schwarz: per chunk at the interface, impulses before a sweep
  double sweeps_needed_ = -1;                ///< as ADMM sees it; < 0: not asked
  double first_residual2_ = 0;               ///< at the first check, or the first since ADMM [m^2/s^2]
  std::size_t history_from_ = 0;             ///< first check since the impulses were last made by ADMM
  int sweeps_from_ = 0;                      ///< epoch of the first sweep of the segment
  int segment_ = 0;  ///< epoch of the next accumulate; written at gates only, when every thread waits
};

}  // namespace talus
