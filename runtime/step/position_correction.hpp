#pragma once

#include <utility>
#include <vector>

#include "kernels/sweeps/momentum.hpp"
#include "kernels/sweeps/positions.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/step/chunk_work.hpp"
#include "runtime/step/methods/sweep_plan.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Parameters of the sweeps that undo overlaps.
struct PositionCorrectionRule {
  /// Sweeps per step, >= 1. The next steps undo the overlaps that remain, and start from the pushes of this
  /// one.
  int sweeps = 10;
  /// Pushes of a chunk that do more than this part of their work beyond what overlaps ask for are lowered, in
  /// (0, 1). With less each step pays for it: 5 % of the demo's time.
  double excess = 0.25;
  /// As for sweeps without friction, but without over-relaxation: so few sweeps would overshoot and open
  /// gaps, into which grains fall; a column sank that way.
  MomentumParameters momentum{.over_relaxation = 1};
};

/// Work of chunks in the epochs that undo overlaps, after the iterations of a step
/// (kernels/sweeps/positions.hpp). Displacements of bodies use the memory of the velocities in single
/// precision, and what their sweeps remember that of the iterations' acceleration: nothing needs either any
/// more then. Displacements of walls' copies use that of their velocities, which are saved meanwhile.
/// Displacements are glued like velocities, so that all copies of a body move alike.
class PositionCorrection {
 public:
  /// Keeps references.
  PositionCorrection(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
                     const SweepKernels& kernels, ChunkWork& work)
      : state_(state), parameters_(parameters), settings_(settings), kernels_(kernels), work_(work) {}

  /// Whether the scene asks for it.
  bool wanted() const { return settings_.overlap_correction > 0; }
  /// How many epochs it takes: one that moves bodies by the pushes of the last step, then the sweeps.
  int epochs() const { return 1 + rule_.sweeps; }

  /// To be called when the candidates are new: no pushes are known of them.
  void plan() { pushes_.clear(); }
  /// Before the iterations of a step: there are no displacements yet.
  void forget() { found_ = false; }
  /// At a gate, after the iterations.
  void begin();
  /// What a chunk does in epoch number `epoch` of these, from 0.
  void run(std::size_t chunk, int epoch);
  /// At a gate, after the last sweep: gives the copies of walls their velocities back.
  void end();

  /// After the loop: x += d of the bodies in `range`.
  void move(SlotRange range, std::span<Vec3> x) const;
  /// Per chunk: its wall copy, with its displacement [m] in place of the velocity; means nothing unless
  /// found().
  const std::vector<WallCopy>& wall_copies() const { return moved_; }
  /// Whether something may have moved in this step.
  bool found() const { return found_; }

  /// Per candidate, of the last step; empty if candidates were found anew since.
  const std::vector<float>& pushes() const { return pushes_; }
  /// After plan(): starts from such pushes.
  void go_on_from(std::vector<float> pushes) { pushes_ = std::move(pushes); }

 private:
  void find_end_of_step();

  StepState& state_;
  const StepParameters& parameters_;
  const SolverSettings& settings_;
  const SweepKernels& kernels_;
  ChunkWork& work_;
  PositionCorrectionRule rule_;
  std::vector<float> pushes_;  ///< per candidate, of the last step; in units of mass x m
  std::vector<WallCopy> kept_, moved_;
  // Where all are at the end of the step without displacements: overlaps that the step opens are not undone,
  // and those that it makes are.
  Bodies ends_;  ///< x; where there are clumps, what a turn asks for, too
  std::vector<Wall> walls_;
  Domain domain_;
  bool found_ = false;
};

}  // namespace talus
