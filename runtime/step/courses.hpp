#pragma once

#include "kernels/sweeps/momentum.hpp"
#include "runtime/step/methods/sweep_plan.hpp"

namespace talus {

/// A plan of sweeps, and since when it has been in force.
struct Course {
  SweepPlan plan;
  int from = 0;         ///< its first sweep in the step
  int begun = 0;        ///< the sweep with which its momentum began: `from`, or one in single precision
  bool single = false;  ///< in single precision
};

/// The present course of a step's sweeps and the one before it: a course that a check calls for begins behind
/// the sweep that may have been made since. Sweeps are counted from 0 in each step.
class Courses {
 public:
  const Course& now() const { return now_; }
  const Course& of(int sweep) const { return sweep >= now_.from ? now_ : before_; }

  void begin(const SweepPlan& plan, int from, bool single) {
    before_ = now_;
    now_ = {plan, from, from, single};
    // A sweep that is on its way, with several ranks, belongs to the course before and keeps its beta.
    if (plan.kind == SweepKind::conjugate) conjugate_ = {};
  }
  /// The present course from this sweep on in double precision, its momentum and all.
  void go_on_in_double(int from) {
    before_ = now_;
    now_.from = from;
    now_.single = false;
  }

  /// How much of the acceleration the start of a sweep takes along, in [0, 1).
  double beta(int sweep) const {
    const Course& course = of(sweep);
    if (course.plan.kind == SweepKind::conjugate) return conjugate_.beta;
    return momentum_beta(momentum_, sweep - course.begun, course.plan.most);
  }
  /// Over-relaxation of the normal impulses, in [1, 2). As long as beta is 0 sweeps are plain: they solve
  /// exactly what few sweeps solve.
  double omega(int sweep) const { return beta(sweep) > 0 ? momentum_.over_relaxation : 1; }
  /// With conjugate gradients, behind each sweep: what it changed, squared [J].
  void turn(double change2) { conjugate_.turn(change2); }

 private:
  MomentumParameters momentum_;
  ConjugateGradient conjugate_;
  Course now_, before_;
};

}  // namespace talus
