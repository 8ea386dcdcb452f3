#pragma once

/// The exact answer of one step, by methods that share nothing with the solver's.
///
/// Without friction the step is a convex quadratic problem: velocities are unique, forces are too unless
/// contacts are redundant. With friction several answers may stand side by side. Of several answers the one
/// that is found begins from the run's own impulses: the error that it shows is that to a near solution, and
/// so no accusation that another choice among right answers could have earned.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/study_certificate/step_problem.hpp"

namespace talus::audit {

struct ReferenceLimits {
  double residual = 1e-10;  ///< of the law at a contact, relative: below it the answer counts as found
  double pumped = 1e6;  ///< impulses that grow so many times over what the step can ask for have no answer
  double velocities = 1e-8;  ///< error() of velocities that are known though the law is not met
  double nearly = 1e-6;      ///< residual up to which that may be
  /// Of redundant contacts gaps that contradict one another decide which carry, however little. So forces are
  /// compared with the nearest impulses that meet the law to this residual and whose velocities are exact to
  /// that part of what the impulses change, in the kinetic norm: the answer to gaps that differ so little.
  double forces = 1e-5, forces_velocities = 1e-5;
  double own_velocities = 1e-4;  ///< the second of the run's own impulses, if they meet the law to
                                 ///< `residual`: its velocities are judged by themselves
  double motion = 1e-9;     ///< least exchange, over what all bodies have, kinetic norm: below it is rounding
  double speeds = 1e-4;     ///< least unit of residuals, over the speeds of bodies: below it is rounding
  int pivots = 400;         ///< smooth: changes of the set of contacts that carry, per proximal step
  int pivots_in_cell = 60;  ///< ... of a cell, before an interior point method makes a guess
  int proximal_steps = 24;  ///< each begins from the impulses of the last one
  std::int64_t contact_solves = 1'000'000;  ///< friction: contacts that may be swept in all attempts
};

/// What a search has come to.
enum class Found {
  answer,      ///< the law is met: velocities and forces are known
  velocities,  ///< velocities are known, forces are not
  nothing,     ///< the search failed
  no_answer,   ///< there is none: walls close on grains that cannot get away
};

/// An answer and how well it is known.
struct Reference {
  Found found = Found::nothing;
  std::string why = {};          ///< where no answer was found
  std::vector<Vec3> exact = {};  ///< impulses of the problem's contacts [N s]
  Motion motion = {};            ///< velocities under them
  std::vector<Vec3> r = {};      ///< the impulses next to the run's that forces are compared with [N s]
  double residual = 0;  ///< of the law (natural map), the largest, over the run's largest impulse or the
                        ///< largest speed of approach; where there is no answer unavoidable_approach
  /// Error of the velocities in the kinetic norm [J^1/2], a bound without friction, with friction the next
  /// step of Newton's method; and the norm of what the contacts change, at least the part of the largest
  /// impulse that each of the two methods grants (floor_of_exchange).
  double error = 0, exchanged = 0;

  double uncertainty() const { return exchanged > 0 ? error / exchanged : 0; }
};

/// Per grain, then per wall, then of the cell: a number that those have in common which contacts join, of
/// which joins(c) is true. Driven and fixed walls join nothing; a cell that follows a stress is joined by
/// those between grains.
std::vector<std::size_t> joined_bodies(const StepProblem& problem,
                                       const std::function<bool(std::size_t)>& joins);

/// Number of the cluster of each contact: contacts that share a grain or a pushed wall are of one, and
/// so are all between grains of a cell that follows a stress. `count`:
/// how many there are.
std::vector<std::size_t> clusters_of(const StepProblem& problem, std::size_t& count);

/// Cluster by cluster. `run`: the impulses that the run found, from which the search begins.
Reference solve_reference(const StepProblem& problem, std::span<const Vec3> run,
                          const ReferenceLimits& limits = {});

/// Without friction: proximal steps, each an exact solve of the complementarity problem by block principal
/// pivoting (Portugal, Judice and Vicente 1994) in 80-bit arithmetic.
Reference solve_smooth(const StepProblem& problem, std::span<const Vec3> run, const ReferenceLimits& limits);

/// The speed of approach that no velocities can avoid, at the worst contact, over the largest one; 0 where
/// some velocities meet v_n + b >= 0 everywhere, up to rounding.
double unavoidable_approach(const StepProblem& problem, const ReferenceLimits& limits);

/// With friction: projected Gauss-Seidel with Anderson's acceleration, and Newton's method from where it got.
Reference solve_frictional(const StepProblem& problem, std::span<const Vec3> run,
                           const ReferenceLimits& limits);

}  // namespace talus::audit
