#pragma once

/// How far a step is from its exact answer.

#include <cmath>
#include <optional>
#include <vector>

#include "apps/study_certificate/reference.hpp"

namespace talus::audit {

/// Parts of other quantities of a step that what its contacts exchange counts as at least. They belong to
/// what is claimed (docs/certificate.md), not to the judge: a test holds them against StepErrorThresholds.
struct ErrorUnits {
  double walls = 1e-8;      ///< of the largest wall impulse
  double elsewhere = 1e-6;  ///< of what all exchange, by a cluster's share of the mass: less is what the end
                            ///< of an earlier motion has left of it
  double held = 1e-6;       ///< of what cohesion holds with
  double lopsided = 100;    ///< heaviest over lightest body, beyond which the mass of all says little
};

/// True errors of a step, each relative, without what rounding of positions is worth (a step at rest). Let E
/// be the momentum that the contacts exchange in the exact answer, sum m |u* - u_free| over grains, pushed
/// walls and a cell that follows a stress, but at least 10⁻⁸ of the largest wall impulse (grains
/// pressed between fixed walls gain nothing), and what the speed of a driven wall, or of a
/// driven flow over a diameter, gives to all; and at least so much that what rounding is excused for is no
/// more of it than StepEnd::claimed.
struct TrueErrors {
  double velocity = 0;  ///< V: sum m |u - u*| over E
  /// wf: largest error of a wall's impulse over the largest wall impulse or load (where cohesion holds grains
  /// to walls, over that which it presses them with, too). The faces of a cell count
  /// as walls: sum r (x) b/d of all contacts, a column for each axis.
  double wall_force = 0;
  double contact_force = 0;  ///< cf: largest error of a contact's impulse over the largest contact impulse
  double cluster = 0;        ///< V of the bodies that push one another where it is largest
  double energy = 0;         ///< energy gained that neither loads nor the time step explain, over the kinetic
                             ///< energy without contacts; 0 where walls move and with cohesion
};

/// What a step ended with, as the run says.
struct StepEnd {
  const Frame& after;                    ///< in the terms of the problem (end_in_cell)
  std::span<const Vec3> r;               ///< impulses_of
  CellVector cell = CellVector::Zero();  ///< U of Motion [m/s]
  std::span<const Vec3> w = {};          ///< spins_at_end; empty: not asked
  /// Speeds of the grains before the step and after it, together [m/s]: what rounding is a part of, though
  /// velocities that an impact turns round have a mean of 0. Empty: those of the problem are as large.
  std::span<const double> speeds = {};
  /// The relative error that the step claims. Where that part of what bodies exchange is less than what
  /// rounding of positions is excused for, no answer is known as well as it.
  double claimed = INFINITY;
};

/// w of Motion that the run's grains have in the axes of the middle of the step, in the terms of the problem;
/// empty without rotation.
std::vector<Vec3> spins_at_end(const StepProblem& problem, const Frame& after);

/// What rounding of positions makes of impulses [N s], at most: of each contact and of each wall. Empty: what
/// the mass of their cluster gains at problem.rounding_speed says how much.
struct FeltRounding {
  std::vector<double> contacts = {}, walls = {};
  double of_contact(std::size_t c) const { return contacts.empty() ? INFINITY : contacts[c]; }
  double of_wall(std::size_t w) const { return walls.empty() ? INFINITY : walls[w]; }
};

/// Where a body is far heavier than another, and what rounding makes of the mass of all could hide an error
/// of what is `claimed`: by how much the exact answer changes when gaps differ by all the rounding that is
/// excused, over how many times that is, as far as it is found; and what rounding makes of the light ones.
FeltRounding felt_rounding(const StepProblem& problem, const Reference& reference, double claimed,
                           const ReferenceLimits& limits = {});

TrueErrors true_errors(const StepProblem& problem, const Reference& reference, const StepEnd& end,
                       const FeltRounding& felt_at = {});

/// Largest momentum of a grain, in its motion or in its turn, that its impulses do not explain, over the
/// largest impulse or its own momentum: rounding (frames have forces in single precision), unless the run's
/// contacts are not those of the problem.
double disagreement(const StepProblem& problem, const StepEnd& end);

/// Energy that a step gained beyond the share that the scheme itself may add, m (h g)^2/8 a grain
/// (docs/theory.md), over its kinetic energy without contacts and that of the momentum which V is compared
/// with at least (ErrorUnits::walls). Heights change by the motion: what `overlap_correction` shifts sets
/// nothing in motion and does not count.
double energy_gain(const StepProblem& problem, const Frame& before, const Frame& after);

}  // namespace talus::audit
