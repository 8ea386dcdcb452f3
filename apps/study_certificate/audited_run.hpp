#pragma once

/// Runs a scene in this process and holds every step against its exact answer.

#include <functional>
#include <string>
#include <vector>

#include "apps/study_certificate/true_errors.hpp"
#include "apps/study_certificate/unexplained_shift.hpp"
#include "io/scene/scene.hpp"

namespace talus::audit {

/// What came of the search for a step's exact answer.
enum class Judged {
  yes,            ///< found: the errors are those of the step
  no_reference,   ///< not found, or not to a tenth of what the step claims
  no_answer,      ///< there is none: walls close on grains that cannot get away
  other_problem,  ///< the run has contacts that the audit does not, other velocities than its impulses give,
                  ///< or other places than its velocities
};

/// One step.
struct AuditedStep {
  std::int64_t step = 0;  ///< from 1
  std::int64_t contacts = 0, clusters = 0;
  bool smooth = true;
  bool certified = false;
  bool overlapping = false;  ///< beyond the tolerance on overlaps: the time step is too long for the scene
  double error_rms = 0, balance = 0;
  double claimed = 0;  ///< the largest of error_rms, balance and the tolerance
  double asked = 0;    ///< the larger of tolerance and balance_tolerance
  int iterations = 0;
  Judged judged = Judged::no_reference;
  std::string why;           ///< where it is not judged
  double unexplained = 0;    ///< disagreement() of the run with the problem
  UnexplainedShift shift;    ///< of the run beside the problem
  bool forces_known = true;  ///< where judged; else forces are over-determined, velocities are not
  TrueErrors errors;
  double residual = 0, uncertainty = 0;  ///< of the reference
  double run_seconds = 0, audit_seconds = 0;
};

struct AuditedRun {
  std::vector<AuditedStep> steps;
  std::string ended;      ///< "" when all steps were done; else the error that ended the run
  bool of_run = false;    ///< it is the run's own, not one of the audit
  bool no_space = false;  ///< it is a NoSpaceError

  /// It ended by itself behind a step that says that it does not hold, or in one in which walls pass one
  /// another or a stress has squeezed its cell too far: the run has fooled nobody.
  bool gave_up() const;
};

struct AuditPlan {
  std::int64_t steps = 20;  ///< at most, of the scene's stages
  ReferenceLimits limits;
};

/// `scene` with walls placed, `bodies` its grains before the first step. `goes_on` is asked behind every
/// step. Throws nothing: what the simulation throws is AuditedRun::ended.
AuditedRun audit_run(const io::Scene& scene, const Bodies& bodies, const AuditPlan& plan,
                     const std::function<bool(const AuditedStep&)>& goes_on = {});

}  // namespace talus::audit
