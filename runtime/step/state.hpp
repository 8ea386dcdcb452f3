#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/bodies/motion.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/detection/measures.hpp"
#include "kernels/shapes/walls.hpp"
#include "kernels/sweeps/single_precision.hpp"
#include "kernels/sweeps/sweep.hpp"
#include "runtime/step/cell_flow.hpp"
#include "runtime/step/decomposition.hpp"
#include "runtime/step/given_forces.hpp"
#include "runtime/step/overlap.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/stressed_cell.hpp"

namespace talus {

/// What the current stage prescribes; constant during a step.
struct StepParameters {
  double time_step = 0;  ///< h [s]
  Vec3 gravity = Vec3::Zero();
  Mat3 velocity_gradient = Mat3::Zero();  ///< of the periodic cell [1/s]
  PairTable laws;
  /// Any friction coefficient > 0, or clumps: impulses have three components and bodies may turn.
  bool friction = false;
  bool rotates = false;  ///< friction, and grains that rotate
  bool rolls = false;    ///< some contacts resist rolling, of grains that rotate
  bool clumps = false;   ///< there are bodies that may be clumps
  ImpulseKind impulses() const {
    return rolls ? ImpulseKind::rolling : friction ? ImpulseKind::force : ImpulseKind::normal;
  }
  double alert = 0;       ///< [m]
  double skin = 0;        ///< [m]
  double turning = 0;     ///< [m] GapRule::turning
  double reflection = 0;  ///< E of Moreau's restitution, 0 without (kernels/law/restitution_law.hpp)
  /// How long loads act on the velocities that the iterations find [s]: force = impulse / impulse_time().
  double impulse_time() const { return time_step / (1 + reflection); }
};

/// One wall during a step.
struct WallState {
  Vec3 free_velocity = Vec3::Zero();   ///< without contacts [m/s]
  double applied = 0;                  ///< force pushed with, along the normal [N]
  std::vector<ChunkId> copies;         ///< chunks here that hold a copy, ascending; filled before the sweeps
  std::int64_t copies_everywhere = 0;  ///< on all ranks
  Vec3 impulse = Vec3::Zero();         ///< of the wall on the grains [N s], from the last check
  Pose middle, end;  ///< of a wall with a prescribed motion, in the middle and at the end of the step
  double speed = 0;  ///< of such a wall: the largest with which a point of its surface nears a grain [m/s]
  double material_speed = 0;  ///< the largest of any point of its material near a grain [m/s]
  double farthest = 0;        ///< of a plane that turns: distance of the farthest grain from its pivot [m]
  Vec3 own_point = Vec3::Zero();      ///< about which its torque is reported, in the middle of the step [m]
  Vec3 mean_velocity = Vec3::Zero();  ///< of the step [m/s]
  Vec3 torque = Vec3::Zero();         ///< of the last step, on the grains, times its impulse time [N m s]
  double work = 0;                    ///< done on the grains since the run began [J]
};

/// All that a step reads and writes. Sizes: n bodies, c candidates, k chunks.
struct StepState {
  Bodies bodies;              ///< n
  std::vector<Clump> clumps;  ///< of the setup
  Domain domain;              ///< now
  CellFlow flow;              ///< motion of its edges
  StressedCell cell;          ///< its components that follow a stress
  std::vector<Wall> walls;
  std::vector<WallState> wall_states;  ///< like walls
  FreeVelocity free;                   ///< n, or empty parts
  std::vector<Vec3> x_then;            ///< n: centres at the last broad phase [m]
  std::vector<double> reach_then;      ///< n: reach at the last broad phase [m]
  std::vector<Vec3> wall_then;         ///< points of the walls at the last broad phase [m]
  double time = 0;                     ///< of the run as the step begins [s]
  double time_then = 0;                ///< of the run, to which places at the last broad phase belong [s]
  Candidates candidates;               ///< c
  Chunks chunks;                       ///< k
  Decomposition decomposition;
  Contacts contacts;              ///< room for c
  SingleState single;             ///< room for c and n, or empty
  std::vector<WallCopy> copies;   ///< k; used by chunks at walls
  bool candidates_valid = false;  ///< false: the next step begins with a broad phase
  /// Overlaps that the sample began with (overlap.hpp), the same on all ranks; none before the first step.
  std::optional<std::vector<GivenOverlap>> given_overlaps;
  /// Forces that the first step starts from, until it has found its candidates; any part of all on each rank.
  std::vector<GivenForce> given_forces;
  bool forces_given = false;  ///< on any rank, and not taken yet
};

/// The shapes of the bodies here.
inline ClumpView clumps_of(const StepState& state, const Bodies& bodies) {
  return {bodies.shape, bodies.orientation, state.clumps};
}
inline ClumpView clumps_of(const StepState& state) {
  return clumps_of(state, state.bodies);
}

/// Where bodies and walls are.
inline Poses poses_of(const StepState& state) {
  return {state.bodies.x, state.bodies.radius, state.walls, clumps_of(state), state.domain};
}

/// How the bodies end a step, but for the shares of their copies.
StepFinish finish_of(const StepState& state, const StepParameters& parameters);

std::size_t memory_used(const StepState& state);

}  // namespace talus
