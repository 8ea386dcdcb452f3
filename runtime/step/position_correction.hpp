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

/// Numbers of the sweeps that undo overlaps.
struct PositionCorrectionRule {
  /// Sweeps per step, >= 1. What they leave is left to the next steps, which go on from their pushes.
  int sweeps = 10;
  /// As of sweeps without friction, but not over-relaxed: what so few sweeps overshoot opens gaps, into which
  /// grains fall, and a column sank by it.
  MomentumParameters momentum{.over_relaxation = 1};
};

/// What chunks do in the epochs behind those of a step that undo overlaps (kernels/sweeps/positions.hpp).
/// Displacements take the room of velocities in single precision, which nothing needs any more then, and
/// those of walls' copies that of their velocities, which are kept aside. They are glued as velocities are,
/// so that all copies of a body go the same way.
class PositionCorrection {
 public:
  /// Keeps references.
  PositionCorrection(StepState& state, const SolverSettings& settings, const SweepKernels& kernels,
                     const ChunkWork& work)
      : state_(state), settings_(settings), kernels_(kernels), work_(work) {}

  /// The scene asks for it.
  bool wanted() const { return settings_.overlap_correction > 0; }
  /// How many epochs it takes: one in which bodies move by what the last step's pushes ask, then the sweeps.
  int epochs() const { return 1 + rule_.sweeps; }

  /// The candidates are new: no pushes are known of them.
  void plan() { pushes_.clear(); }
  /// Before the iterations of a step: bodies stay where they are.
  void forget() { found_ = false; }
  /// At a gate, behind the iterations.
  void begin();
  /// What a chunk does in epoch number `epoch` of these, from 0.
  void run(std::size_t chunk, int epoch);
  /// At a gate, behind the last sweep: the copies of walls have their velocities again.
  void end();

  /// Behind the loop: x += d of bodies here.
  void move(SlotRange range, std::span<Vec3> x) const;
  /// Per chunk: displacements of its wall copy [m] in the place of velocities; void unless found().
  const std::vector<WallCopy>& wall_copies() const { return moved_; }
  /// Something may have moved in this step.
  bool found() const { return found_; }

  /// Per candidate, of the last step; empty where there was none since the candidates are new.
  const std::vector<float>& pushes() const { return pushes_; }
  /// Behind plan(): goes on from such pushes.
  void go_on_from(std::vector<float> pushes) { pushes_ = std::move(pushes); }

 private:
  StepState& state_;
  const SolverSettings& settings_;
  const SweepKernels& kernels_;
  const ChunkWork& work_;
  PositionCorrectionRule rule_;
  AccelerationHistory acceleration_;
  std::vector<float> pushes_;  ///< per candidate, of the last step; in units of mass x m
  std::vector<WallCopy> kept_, moved_;
  bool found_ = false;
};

}  // namespace talus
