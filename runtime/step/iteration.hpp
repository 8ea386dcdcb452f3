#pragma once

#include <cstdint>
#include <vector>

#include "runtime/step/state.hpp"

namespace talus {

/// How the iterations of a step ended.
struct IterationResult {
  int iterations = 0;  ///< sweeps
  double error_rms = 0, error_max = 0;
  double drift = 0;  ///< change of the wall impulses over the second half of the iterations, relative
  std::int64_t contacts = 0, active = 0;
  bool converged = false;
};

/// The iteration part of a step as a program on the chunk graph: every epoch, each chunk does one thing, in
/// the order of its colour.
///
///   epoch   s            s+1               s+2 ... s+1+n   s+2+n        s+3+n
///           accumulate   measure -> gate   n sweeps        accumulate   measure -> gate ...
///
/// `accumulate` makes V afresh from r, so that the error is never that of a drifted V and the step ends on
/// what was certified. At a gate one thread adds the chunks' sums in order and decides whether to go on; the
/// distance n of the gates grows with the iterations done. Nodes 0..k-1 are the chunks; one node per wall of
/// finite mass follows and glues the copies that its chunks hold.
class Iteration {
 public:
  /// References are kept. `state.contacts` holds the narrow phase's contacts.
  Iteration(StepState& state, const StepParameters& parameters, const SolverSettings& settings);

  void node(std::uint32_t node, int epoch);
  bool gate(int epoch) const { return epoch == segment_ + 1; }
  bool decide(int epoch);

  /// Before the first epoch of a step: glues, copies and sums fitted to the contacts found. Returns the glued
  /// walls.
  void begin();

  const std::vector<std::int32_t>& glued_walls() const { return glued_; }
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
  template <bool Friction>
  void chunk(std::size_t c, Work work);
  double impulse_scale() const;
  double drift() const;

  StepState& state_;
  const StepParameters& parameters_;
  const SolverSettings& settings_;
  std::vector<std::int32_t> glued_;          ///< walls of finite mass with contacts
  std::vector<ErrorSums> sums_;              ///< per chunk
  std::vector<std::vector<Vec3>> impulses_;  ///< per check: impulse of every wall [N s]
  std::vector<Check> history_;
  IterationResult result_;
  int segment_ = 0;  ///< epoch of the next accumulate; written at gates only, when every thread waits
};

}  // namespace talus
