#pragma once

/// Results that leave the simulation, as plain copies, so that files are written while the next step runs.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/domain.hpp"
#include "kernels/shapes/prescribed_motion.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/field_grids.hpp"
#include "runtime/step/overlap.hpp"
#include "runtime/step/worst_errors.hpp"

namespace talus {

/// The certificate of one step (docs/formats.md, steps.csv).
struct StepReport {
  std::int64_t step = 0;  ///< number of steps done, from 1
  double time = 0;        ///< [s] at the end of the step
  double time_step = 0;   ///< h of the step [s]
  std::int64_t candidates = 0;
  std::int64_t contacts = 0;            ///< pairs that touch, or may within the step (docs/theory.md)
  std::int64_t active = 0;              ///< normal impulse > 0
  int iterations = 0;                   ///< sweeps
  double error_rms = 0, error_max = 0;  ///< natural map over velocity scale
  double error_quantile = 0;            ///< SolverSettings::quantile of them, where that has a tolerance
  WorstErrors worst = {};               ///< of a step whose iterations did not converge
  double balance = 0;  ///< estimated error of the forces, or momentum defect of the sample, the larger
  double velocity_error =
      0;  ///< estimated error of velocities in clusters that no direct solve takes, over what they exchange
  double jump = 0;                                   ///< interface jump (several subdomains)
  double penetration_mean = 0, penetration_max = 0;  ///< over smallest radius, at the end of the step
  double overlap = 0;  ///< largest that the run has made, over the pair's smaller radius (overlap.hpp)
  std::optional<BodyPair> overlapping = {};              ///< that pair, where it is beyond the tolerance
  double kinetic_translation = 0, kinetic_rotation = 0;  ///< [J]
  double solid_fraction = 0;                             ///< 0 when the walls do not close a box
  double equilibrium =
      0;  ///< distance from equilibrium: the larger of net forces over load and kinetic energy over
          ///< load x mean diameter (docs/theory.md, "Equilibrium"); infinite without a load
  std::int64_t migrants = 0;
  double imbalance = 1;  ///< largest over mean work of the subdomains
  double wall_s = 0;     ///< elapsed time of the step [s]
  bool converged = false;
  std::int64_t passed = 0;  ///< pairs that went through one another, or deep into one another, within the
                            ///< step: the step is too long for them, and counts as not converged
  /// Of the motion against the flow and the mean (cell_report.hpp) [J], in a loaded cell that nothing else
  /// bounds; as equilibrium asks for it, the row of cell.csv need not sum it up again.
  std::optional<Mat3> kinetic_moment = {};
};

/// visit(name, number) for each number of a report; names of bodies are left out.
template <class Report, class Visit>
void each_number(Report& report, const Visit& visit) {
  visit("report_step", report.step);
  visit("report_time", report.time);
  visit("report_time_step", report.time_step);
  visit("report_candidates", report.candidates);
  visit("report_contacts", report.contacts);
  visit("report_active", report.active);
  visit("report_iterations", report.iterations);
  visit("report_error_rms", report.error_rms);
  visit("report_error_max", report.error_max);
  visit("report_error_quantile", report.error_quantile);
  visit("report_balance", report.balance);
  visit("report_velocity_error", report.velocity_error);
  visit("report_jump", report.jump);
  visit("report_penetration_mean", report.penetration_mean);
  visit("report_penetration_max", report.penetration_max);
  visit("report_overlap", report.overlap);
  visit("report_kinetic_translation", report.kinetic_translation);
  visit("report_kinetic_rotation", report.kinetic_rotation);
  visit("report_solid_fraction", report.solid_fraction);
  visit("report_equilibrium", report.equilibrium);
  visit("report_migrants", report.migrants);
  visit("report_imbalance", report.imbalance);
  visit("report_wall_s", report.wall_s);
  visit("report_converged", report.converged);
  visit("report_passed", report.passed);
}

/// One row of walls.csv.
struct WallReport {
  std::string name;
  double position = 0;         ///< normal . point [m]
  double velocity = 0;         ///< along the normal [m/s]
  Vec3 force = Vec3::Zero();   ///< of the wall on the grains, mean over the step [N]
  Vec3 torque = Vec3::Zero();  ///< likewise, about the wall's own point [N m] (Wall::torque_point)
  double work = 0;             ///< done on the grains since the run began [J]
  Vec3 normal = Vec3::Zero();  ///< of a plane, into the grains; 0 of a surface, and of a group
  Pose pose = {};              ///< of a surface: its motion from where the scene has put it
  bool absent = false;         ///< the wall is absent in this stage
};

/// One row of bodies.csv: a body that the scene names, at the end of a step.
struct BodyReport {
  std::string name;
  Vec3 x = Vec3::Zero();      ///< [m]
  Vec3 u = Vec3::Zero();      ///< [m/s]
  Vec3 omega = Vec3::Zero();  ///< [rad/s]
  Vec3 force = Vec3::Zero();  ///< of its contacts on it, mean over the step [N]: what its momentum gained,
                              ///< less gravity
};

/// One row of inserted.csv: what an insertion has done since the beginning.
struct InsertReport {
  std::string name;
  std::int64_t placed = 0;   ///< grains
  double mass = 0;           ///< [kg] of these
  std::int64_t waiting = 0;  ///< grains that are due, and for which no room was found yet
  std::int64_t no_room = 0;  ///< steps in which room was missing for one grain or more
};

/// One row of removed.csv: what a removal has taken away since the beginning.
struct RemoveReport {
  std::string name;
  std::string material;  ///< "" where materials have no names
  std::int64_t count = 0;
  double mass = 0;  ///< [kg]
};

/// One row of probes.csv. Numbers that its kind of probe does not have are 0: contents for discs and planes,
/// passages for other regions, numbers per volume for all beyond a plane.
struct ProbeReport {
  /// Grains of one material.
  struct OfMaterial {
    std::int64_t count = 0, passed_count = 0;
    double mass = 0, passed_mass = 0;  ///< [kg]
  };
  std::string name;
  std::int64_t count = 0;  ///< grains whose centre is in the region; means are over these
  double mass = 0;         ///< [kg]
  double solid_fraction = 0;
  Vec3 velocity = Vec3::Zero();        ///< of their centre of mass [m/s]
  double temperature = 0;              ///< a third of the mean square velocity relative to that [m^2/s^2]
  double coordination = 0;             ///< active contacts per grain, including those with walls
  Mat3 contact_stress = Mat3::Zero();  ///< [Pa], positive in compression: force, then branch
  Mat3 kinetic_stress = Mat3::Zero();  ///< [Pa]
  std::int64_t passed_count = 0;       ///< along the normal less against it, since the run began
  double passed_mass = 0;              ///< [kg]
  double count_rate = 0;               ///< [1/s] of them, mean since the last report
  double mass_rate = 0;                ///< [kg/s]
  std::vector<OfMaterial> materials;   ///< by number
};

/// One row of triaxial.csv; compression is positive for stresses, strains (28)-(30) are negative in
/// compression as in the paper.
struct TriaxialReport {
  std::int64_t step = 0;
  double time = 0;
  std::string stage;
  std::array<double, 3> strain{};  ///< (28) along x, y, z since the beginning of the stage
  double strain_volume = 0;        ///< (29)
  double strain_shear = 0;  ///< (30): eps_h - eps_l along the axis of the stage, mean of both lateral ones
  double solid_fraction = 0;
  std::array<double, 3> stress{};     ///< [Pa] diagonal of the Love-Weber stress
  double p = 0, q = 0, q_over_p = 0;  ///< p = mean stress; q = axial minus mean lateral [Pa]
  double coordination = 0;            ///< active contacts per grain, without rattlers and their contacts
  bool converged = true;              ///< of the step (StepReport)
};

/// One row of cell.csv: a periodic cell and what is in it at the end of a step. Tensors as xx, yy, zz, xy,
/// xz, yz of their symmetric parts, compression positive.
struct CellReport {
  std::int64_t step = 0;
  double time = 0;  ///< [s]
  std::string stage;
  std::array<double, 6> edges{};           ///< PeriodicSpace [m]
  std::array<double, 6> stress{};          ///< of the contacts, mean over the step (Love-Weber) [Pa]
  std::array<double, 6> kinetic_stress{};  ///< kinetic_moment over the volume [Pa]
  double p = 0, q = 0, q_over_p = 0;  ///< of the contacts: mean stress, root of 3/2 s : s, s its deviator
  double solid_fraction = 0;
  double contacts_a_grain = 0;       ///< active contacts per grain, over all grains
  double coordination = 0;           ///< likewise, without rattlers and their contacts
  std::array<double, 6> fabric{};    ///< mean of n (x) n over the contacts that carry, symmetric: xx, ..., yz
  double a_c = 0, a_n = 0, a_t = 0;  ///< anisotropies along the stress (runtime/step/force_fabric.hpp)
  double fabric_q_over_p = 0;        ///< q/p that these make together (stress_ratio_of)
  double inertial_number = 0;        ///< rate of shear x mean diameter x root of density over p; infinite
                                     ///< in a flow that nothing presses
  bool converged = true;             ///< of the step (StepReport)
};

/// State at an output time. The first vectors are per body, those named contact_ per contact with a force. On
/// several ranks each has a part: bodies in order of id, contacts in order of their ids, and rank after rank.
struct Frame {
  std::int64_t step = 0;
  double time = 0;
  std::string stage;
  std::vector<std::int64_t> id;
  std::vector<Vec3> x;                             ///< [m]
  std::vector<double> radius;                      ///< [m]
  std::vector<Vec3> u;                             ///< [m/s]
  std::vector<Vec3> omega;                         ///< [rad/s]; empty without rotation
  std::vector<std::array<double, 4>> orientation;  ///< empty unless asked for
  std::vector<std::int64_t> material;              ///< number in the scene; empty where it names none
  std::vector<std::array<std::int64_t, 2>> contact_bodies;  ///< ids; second is -(1 + wall index) at a wall
  std::vector<Vec3> contact_point;                          ///< [m]
  std::vector<Vec3> contact_normal;                         ///< unit, from the second body to the first
  std::vector<double> contact_gap;                          ///< [m] at the end of the step
  std::vector<Vec3> contact_force;                          ///< on the first body, mean over the step [N]
  std::vector<Vec3> contact_moment;  ///< of rolling resistance, likewise [N m]; empty where nothing resists
  std::vector<WallReport> walls;
  Domain domain = {};            ///< of the bodies; x and contact_point are wrapped
  std::vector<FieldGrid> grids;  ///< that the scene asks for; none before the first step
  bool with_contacts = true;     ///< false: contacts are left out, though there may be some
};

struct StepState;

/// Fills the bodies and contacts of `frame`: this rank's part, about as large as that of any other. A contact
/// goes to the rank of its first body; its force is its impulse over `impulse_time` [s]. Collective; rows
/// travel in bounded pieces.
void fill_frame(const StepState& state, const graph::Communicator& ranks, bool rotation, bool contacts,
                double impulse_time, Frame& frame);

}  // namespace talus
