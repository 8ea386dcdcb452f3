#pragma once

#include "kernels/sweeps/momentum.hpp"
#include "runtime/step/methods/sweep_plan.hpp"

namespace talus {

/// A plan of sweeps (methods/sweep_plan.hpp), and the sweep from which it is in force.
struct Course {
  SweepPlan plan;
  int from = 0;         ///< its first sweep in the step
  int begun = 0;        ///< the sweep with which its momentum began: `from`, or an earlier single one
  bool single = false;  ///< in single precision
};

/// The present course of a step's sweeps and the one before it. With several ranks the next sweep is already
/// in flight when a check calls for a new course; that sweep still belongs to the course before. Sweeps are
/// counted from 0 in each step.
class Courses {
 public:
  const Course& now() const { return now_; }
  const Course& of(int sweep) const { return sweep >= now_.from ? now_ : before_; }

  void begin(const SweepPlan& plan, int from, bool single) {
    before_ = now_;
    now_ = {plan, from, from, single};
    // Other courses leave beta alone: with several ranks a sweep in flight belongs to the course before.
    if (plan.kind == SweepKind::conjugate) conjugate_ = {};
  }
  /// From this sweep on the present course, with its momentum, is in double precision.
  void go_on_in_double(int from) {
    before_ = now_;
    now_.from = from;
    now_.single = false;
  }

  /// Factor of the acceleration at the start of a sweep, in [0, 1).
  double beta(int sweep) const {
    const Course& course = of(sweep);
    if (course.plan.kind == SweepKind::conjugate) return conjugate_.beta;
    return momentum_beta(momentum_, sweep - course.begun, course.plan.most);
  }
  /// Over-relaxation of the normal impulses, in [1, 2). Sweeps are plain while beta is 0: over-relaxation
  /// would miss what a few plain sweeps solve exactly.
  double omega(int sweep) const { return beta(sweep) > 0 ? momentum_.over_relaxation : 1; }
  /// After each sweep of conjugate gradients: the squared norm of its change [J].
  void turn(double change2) { conjugate_.turn(change2); }

 private:
  MomentumParameters momentum_;
  ConjugateGradient conjugate_;
  Course now_, before_;
};

}  // namespace talus
