#pragma once

/// The exact answer of one step, by methods that share nothing with the solver's.
///
/// Without friction the step is a convex quadratic problem: velocities are unique, forces are too unless
/// contacts are redundant. With friction several answers may stand side by side. Of several answers the one
/// that is found begins from the run's own impulses: the error that it shows is that to a near solution, and
/// so no accusation that another choice among right answers could have earned.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/study_certificate/step_problem.hpp"

namespace talus::audit {

struct ReferenceLimits {
  double residual = 1e-10;  ///< of the law at a contact, relative: below it the answer counts as found
  double speeds = 1e-5;     ///< least unit of residuals, over the speeds of bodies: below it is rounding
  int pivots = 400;         ///< smooth: changes of the set of contacts that carry, per proximal step
  int proximal_steps = 30;  ///< each begins from the impulses of the last one
  std::int64_t contact_solves = 1'000'000;  ///< friction: contacts that may be swept in all attempts
};

/// An answer and how well it is known.
struct Reference {
  bool found = false;
  std::string why = {};      ///< where it was not found
  std::vector<Vec3> r = {};  ///< impulses of the problem's contacts [N s]
  Motion motion = {};        ///< under them
  double residual = 0;       ///< of the law (natural map), the largest, over the run's largest impulse or the
                             ///< largest speed of approach
  double uncertainty = 0;    ///< of the velocities, kinetic norm, over what the contacts change: a bound
                             ///< without friction, with friction the next step of Newton's method
};

/// Number of the cluster of each contact: contacts that share a grain or a pushed wall are of one. `count`:
/// how many there are.
std::vector<std::size_t> clusters_of(const StepProblem& problem, std::size_t& count);

/// Cluster by cluster. `run`: the impulses that the run found, from which the search begins.
Reference solve_reference(const StepProblem& problem, std::span<const Vec3> run,
                          const ReferenceLimits& limits = {});

/// Without friction: proximal steps, each an exact solve of the complementarity problem by block principal
/// pivoting (Portugal, Judice and Vicente 1994) in 80-bit arithmetic.
Reference solve_smooth(const StepProblem& problem, std::span<const Vec3> run, const ReferenceLimits& limits);

/// With friction: projected Gauss-Seidel with Anderson's acceleration, and Newton's method from where it got.
Reference solve_frictional(const StepProblem& problem, std::span<const Vec3> run,
                           const ReferenceLimits& limits);

}  // namespace talus::audit
