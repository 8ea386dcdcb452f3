#pragma once

/// The scenes of `talus study stability`: small problems that are hard for a reason, most of them with a
/// known answer.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/step/simulation.hpp"

namespace talus::stability {

/// What a scene comes to (docs/stability.md).
enum class Verdict {
  right,      ///< every step certified and judged, and its true error is within its bound
  certified,  ///< every step certified, but a step has no truth, or energy grew beyond what is certified
  honest,     ///< some step missed its tolerance, or time ran out, and it says so
  refused,    ///< an error that names its cause
  wrong,      ///< a step is certified, and its true error is beyond its bound
  failed,     ///< not a number, an unforeseen error, a crash or a hang
};
using Verdicts = std::vector<Verdict>;
std::string_view name_of(Verdict verdict);

/// What a truth looks at: one step, from its beginning to its end.
struct StepView {
  const Simulation& simulation;
  const std::optional<SavedState>& start;  ///< none with several subdomains
  const Frame& before;                     ///< without contacts
  const Frame& after;

  double time_step() const { return simulation.stage().time_step; }  ///< [s]
  const Vec3& gravity() const { return simulation.stage().gravity; }
};

/// From which states a truth holds.
enum class TruthFrom {
  any_state,  ///< it takes the velocities before the step as they are
  certified,  ///< as long as no step before has missed its tolerance
  rest,       ///< likewise, of a sample at rest: how far the step begins from rest is added to its bound
};

/// The exact answer.
struct Truth {
  /// The true error of a step, relative to what the contacts do in it as a whole (the certificate's unit);
  /// nothing where the answer of this step is not known. Empty: of no step.
  std::function<std::optional<double>(const StepView&)> error;
  TruthFrom from = TruthFrom::any_state;
  std::string lacks = {};  ///< why steps may be without, for the row
};

/// A scene, ready to run.
struct Problem {
  Setup setup;  ///< one stage without an end; the solver's settings are those a user gets unasked
  Bodies bodies;
  int steps = 3;
  Truth truth = {};
  /// Not 0: what the true error may reach whatever the certificate says. 0: twice the certificate.
  double allowed = 0;
};

struct Scene {
  std::string name;
  std::string asks;  ///< what is hard about it, and what is known
  std::function<Problem()> build;
  Verdicts expected = {Verdict::right};  ///< any of these, with the settings of an unasked user
};

/// All scenes, in the order of the table. A name is unique.
std::vector<Scene> scenes();

/// Parts of the table.
void add_columns(std::vector<Scene>& table);
void add_boxes(std::vector<Scene>& table);
void add_wedges_and_arches(std::vector<Scene>& table);
void add_motion(std::vector<Scene>& table);
void add_units(std::vector<Scene>& table);
void add_nonsense(std::vector<Scene>& table);

// --- Building blocks -------------------------------------------------------------------------------------

constexpr double earth = 9.81;       ///< [m/s^2]
constexpr double radius = 0.05;      ///< [m] of a usual grain
constexpr double density = 2600;     ///< [kg/m^3]
constexpr double natural_dt = 1e-3;  ///< [s] 1/100 of the time in which a grain falls by its diameter

Problem problem(double time_step, const Vec3& gravity, double mu);
Stage& stage(Problem& problem);
Wall& add_wall(Problem& problem, std::string name, const Vec3& point, const Vec3& normal);
/// Six fixed walls, x-, x+, y-, y+, z-, z+, around [0, lengths].
void add_box(Problem& problem, const Vec3& lengths);
/// Adds a grain of the given mass; ids count from 0.
Velocity& add_grain(Problem& problem, const Vec3& centre, double r, double mass);
double sphere_mass(double r);  ///< [kg] at the usual density

/// Of a sample at rest: largest error of the walls' forces against `exact` [N], over the largest of `exact`.
Truth wall_forces(std::vector<Vec3> exact);

/// `truth` where a step begins at rest: no body faster than 50 tolerances of g h, a twentieth by default.
/// What a light grain keeps of its velocity under a heavy body is little of the step's impulses and yet opens
/// gaps, into which the heavy one then rightly falls.
Truth at_rest(Truth truth);

/// The velocities that the same step takes when it is solved to 1e-10 with conjugate gradients: the sum of
/// the bodies' errors of momentum over that of what the contacts change. Without friction they are unique.
/// For one subdomain. Nothing known where the reference itself falls short.
Truth reference_velocities();

}  // namespace talus::stability
