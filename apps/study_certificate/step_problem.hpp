#pragma once

/// The contact problem of one step, made anew from the state before it and the formulas of docs/theory.md.
/// Nothing here comes from the solver's rooms (kernels/law, sweeps, global): a judge that shared code with
/// what it judges would share its errors.

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "apps/study_certificate/step_cell.hpp"
#include "apps/study_certificate/step_clump.hpp"
#include "apps/study_certificate/step_walls.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"

namespace talus::audit {

/// How the surfaces of two bodies move at a contact: with u + B w.
struct StepLevers {
  Mat3 first = Mat3::Zero(), second = Mat3::Zero();  ///< B
};

/// A pair that may exchange an impulse r [N s], which acts on `first`, and -r on `second`. A grain may touch
/// a wall in several places, and clumps one another. A moment of rolling resistance stands as one more
/// contact behind that which it belongs to: its r is the moment over the reduced radius l, its velocity l
/// times the relative angular velocity in the tangent plane, its `friction` mu_r, and it has no normal part.
struct StepContact {
  std::size_t first = 0;       ///< grain, its place in the frame
  std::ptrdiff_t second = 0;   ///< grain, or -(1 + wall)
  Vec3 normal = Vec3::Zero();  ///< unit, from the second to the first
  double bias = 0;             ///< b [m/s]: 0 <= v_n + b, perpendicular to r_n >= 0
  double friction = 0;         ///< mu
  /// [m/s] of the second's image beyond it, or of the material of a wall that a cell stretches or that moves
  /// by itself.
  Vec3 drift = Vec3::Zero();
  /// From the second to the first, over the d of the cell; 0 at walls, which do not push it.
  Vec3 branch = Vec3::Zero();
  /// [N s] that cohesion holds with: the law is that of r + pull n, and free motion has -pull n.
  double pull = 0;
  std::optional<StepLevers> levers = {};  ///< of clumps; those of spheres follow from the normal
  Ball ball{Vec3::Zero(), 0};             ///< of clumps: of the first, from its centre, in mid-step [m]
  double rolls = 0;                       ///< of a moment: l [m]; else 0

  bool is_moment() const { return rolls > 0; }
  bool at_wall() const { return second < 0; }
  std::size_t wall() const { return static_cast<std::size_t>(-1 - second); }
  std::size_t other() const { return static_cast<std::size_t>(second); }
};

/// Velocities of everything: per grain [m/s], w = R omega (of a clump TurnedClump::w), and per wall. `cell`:
/// U = d times what the contacts give the gradient of a cell's flow; grains and walls have theirs without it.
struct Motion {
  std::vector<Vec3> u, w, walls;
  CellVector cell = CellVector::Zero();
};

/// So many speeds that rounding of a position makes (StepProblem::rounding_speed) are no error of a velocity.
constexpr double excused_roundings = 5;

/// n grains in the order of the frame, k walls (of which planes move along their normals where pushed).
struct StepProblem {
  double time_step = 0;               ///< loads act so long on the velocities that are found: h/(1 + E) [s]
  double reflection = 0;              ///< E of Moreau's law: those are (V + E V-)/(1 + E)
  Vec3 gravity = Vec3::Zero();        ///< [m/s^2]
  std::vector<double> mass;           ///< n [kg]
  std::vector<double> spin_mobility;  ///< n, R^2/I [1/kg]; 0 where a grain does not turn
  std::vector<TurnedClump> clumps;    ///< n where grains are clumps, else none
  Motion free;                        ///< at the end of the step without contacts, but as cohesion pulls
  Motion unpulled;                    ///< and without cohesion
  std::vector<Vec3> wall_normal;      ///< k
  std::vector<double> wall_inv_mass;  ///< k [1/kg]; 0: fixed or driven
  std::vector<double> wall_load;      ///< k [N]
  StepCell cell;                      ///< one more body where it follows a stress
  /// Largest of the driven walls, of the material of those that move by themselves where it meets a grain,
  /// or of a cell's flow [m/s].
  double drive_speed = 0;
  bool walls_move = false;    ///< some by themselves
  double rounding_speed = 0;  ///< what rounding of positions is worth in a step [m/s]
  std::vector<StepContact> contacts;

  bool smooth() const;  ///< no contact has friction
};

/// The scene's part of a step: what does not change within it.
struct StepInput {
  const Frame& before;                       ///< positions and velocities
  std::span<const Wall> walls;               ///< positions and velocities before the step, loads in force
  std::span<const double> loads;             ///< of each wall, along its normal [N]
  const Stage& stage;                        ///< time step, gravity, laws
  const Bodies& bodies;                      ///< masses, by id, in any order
  const Setup& setup;                        ///< alert distance, overlap correction, rotation, cell
  std::size_t stage_index = 0;               ///< of `stage` in the setup
  double time = 0;                           ///< since the stage began [s]
  std::span<const double> stage_times = {};  ///< how long the stages before took [s]
  /// If given: which side of nothing a gap of rounding is on, of bodies that carry in it. That decides
  /// whether bodies that bounce off one another are a contact.
  const Frame* after = nullptr;
};

/// Throws std::invalid_argument for what there are no formulas for: clumps in a periodic cell, grains that
/// are inserted or removed, rolling resistance of clumps.
void demand_audited(const Setup& setup);

/// Throws what demand_audited throws.
StepProblem rebuild_step(const StepInput& input);

/// Adds to `motion` what an impulse r [N s] of the contact does.
void add_impulse(const StepProblem& problem, const StepContact& contact, const Vec3& r, Motion& motion);

/// Velocity at the end of the step under the impulses, one per contact.
Motion motion_under(const StepProblem& problem, std::span<const Vec3> impulses);

/// Of spheres where a contact has none of its own: B w = n x w, and -n x w of the second.
StepLevers levers_of(const StepContact& contact);

/// Relative velocity of a contact, u_1 - u_2 + B_1 w_1 - B_2 w_2 - drift + U b [m/s].
Vec3 relative_velocity(const StepContact& contact, const Motion& motion);

/// Speed of both bodies without contacts [m/s], of which the relative velocity is a difference; of a wall
/// that of its material.
double speed_of_bodies(const StepProblem& problem, const StepContact& contact);

/// The impulses r + pull n [N s] that the run found, in the order of the problem's contacts, of several of
/// two bodies by their normals, and by the places of equal ones; `unknown`: contacts with a force that the
/// problem does not have.
struct RunImpulses {
  std::vector<Vec3> r;
  std::size_t unknown = 0;
};
RunImpulses impulses_of(const StepProblem& problem, const Frame& after);

}  // namespace talus::audit
