#pragma once

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
  /// Sweeps per step, >= 1. What they leave is left to the next steps: overlaps change slowly.
  int sweeps = 10;
  MomentumParameters momentum;  ///< as of sweeps without friction
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
  int sweeps() const { return rule_.sweeps; }

  /// Before the iterations of a step: bodies stay where they are.
  void forget() { found_ = false; }
  /// At a gate, behind the iterations.
  void begin();
  /// Sweep number `sweep`, from 0, of a chunk.
  void run(std::size_t chunk, int sweep);
  /// At a gate, behind the last sweep: the copies of walls have their velocities again.
  void end();

  /// Behind the loop: x += d of bodies here.
  void move(SlotRange range, std::span<Vec3> x) const;
  /// Per chunk: displacements of its wall copy [m] in the place of velocities; void unless found().
  const std::vector<WallCopy>& wall_copies() const { return moved_; }
  /// Something may have moved in this step.
  bool found() const { return found_; }

 private:
  StepState& state_;
  const SolverSettings& settings_;
  const SweepKernels& kernels_;
  const ChunkWork& work_;
  PositionCorrectionRule rule_;
  AccelerationHistory acceleration_;
  std::vector<WallCopy> kept_, moved_;
  bool found_ = false;
};

}  // namespace talus
