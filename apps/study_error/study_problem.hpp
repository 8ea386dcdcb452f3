#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "apps/study_error/study_variants.hpp"

namespace talus {

/// A check of a solve.
struct ResidualRow {
  StudyVariant variant;
  bool warm = false;  ///< begun from the impulses of the step before
  int sweeps = 0;
  double seconds = 0;    ///< of the iterations up to the check, median of the repetitions [s]
  double error_rms = 0;  ///< natural map, relative (docs/theory.md, "Error")
};

/// What a solve that was stopped after `sweeps` hands back, against the reference.
struct TrueErrorRow {
  StudyVariant variant;
  bool warm = false;
  int sweeps = 0;
  double seconds = 0;
  double error_rms = 0;
  double velocity_error = 0;  ///< |V - V_ref| of the grains in the kinetic norm, over the largest of |V_ref|,
                              ///< what the contacts gave, |V_ref - V_free|, and what the impulse of a wall
                              ///< would give to all grains as one body
  double wall_force_error =
      0;                   ///< largest |F - F_ref| of the walls over the largest |F_ref|; NaN without walls
  bool converged = false;  ///< as a run would call it
};

/// The solution that all others are held against, one per seed. `converged` as a run would call it.
struct ProblemReference {
  std::uint64_t seed = 1;
  std::string method;
  std::int64_t step = 0, bodies = 0, contacts = 0;
  int sweeps = 0;
  double error_rms = 0, tolerance = 0;
  double balance = 0, balance_tolerance = 0;
  bool converged = false;
};

struct ProblemStudy {
  std::vector<ResidualRow> residual;  ///< rows of a solve follow one another
  std::vector<TrueErrorRow> truth;    ///< likewise
  std::vector<ProblemReference> references;
};

/// Takes the sample through `plan.at_step` steps as its scene says, and then solves the next step with every
/// variant of that seed, from no impulses and from those of the step before, to the smallest tolerance. The
/// same step is solved with doubled numbers of sweeps, so that what a solve has reached is known on its way;
/// each solve that is cheap is timed three times. Adds its rows to `study`. `say` takes lines of progress;
/// `keep` is called behind every variant, of which one that fails is said and left out.
/// Throws std::runtime_error when the scene ends before the step; what Simulation throws on the way there;
/// RunawayError when no method solved the step.
void study_problem(const StudySample& sample, const StudyPlan& plan,
                   const std::function<void(const std::string&)>& say, const std::function<void()>& keep,
                   ProblemStudy& study);

}  // namespace talus
