#pragma once

/// How sweeps are accelerated beyond plain Gauss-Seidel, and the parameters of it.

namespace talus {

/// How the start of a sweep goes on from the end of the last one (kernels/sweeps/momentum.hpp).
enum class SweepKind {
  plain,      ///< it starts where the last one ended: nonlinear Gauss-Seidel
  momentum,   ///< along the last step of the impulses
  conjugate,  ///< along the last direction of conjugate gradients
};

/// What a method wants of the next sweeps.
struct SweepPlan {
  SweepKind kind = SweepKind::plain;
  double most = 0;  ///< largest beta, in [0, 1), of momentum; with plain sweeps of the momentum to resume
};

/// Sweeps with momentum (docs/decisions/0009-methods.md).
struct MomentumParameters {
  /// Factor of the change of the normal impulses, in [1, 2). 1.2 takes 4-16 % fewer sweeps than 1, and 1.3
  /// saves no more; at 1.4 packings begin to swing.
  double over_relaxation = 1.2;
  /// First sweeps without momentum, >= 0: a few of them solve simple problems, such as a grain on the ground,
  /// and add no force that nothing requires.
  int plain_sweeps = 3;
  /// beta of sweep k is k/(k + ramp), > 0, until it is `most` (Nesterov 1983).
  double ramp = 3;
  /// The most sweeps between two checks while the error is not seen to fall, >= 1: what momentum makes worse
  /// shows within as many.
  int trusted_sweeps = 25;
  /// beta without friction, in (0, 1): problems are easier, and 0.9 was best to a tolerance of 1e-6.
  double most_without_friction = 0.9;
  /// With friction, in (0, 1): on packings of 16,000 grains 0.92 was best to 1e-3, 0.94 to 1e-4, 0.97 to
  /// 1e-6. What a run of n sweeps can use is 1 - beta = c/n, and the tolerance says about how many they will
  /// be: 1 - beta = gap (tolerance/reference)^power, within [least_most, largest_most].
  double gap = 0.08, reference_tolerance = 1e-3, power = 0.15, least_most = 0.9, largest_most = 0.97;
  /// A check at which the error is so many times that of the check before, > 1, says that momentum is no
  /// method for this problem; one with less growth restarts it with 1 - beta doubled.
  double hopeless_growth = 4;
};

/// The largest beta for a tolerance on error_rms.
double most_momentum(const MomentumParameters& parameters, bool friction, double tolerance);
/// beta of sweep number `sweep` since the momentum began.
double momentum_beta(const MomentumParameters& parameters, int sweep, double most);

/// Nonsmooth nonlinear conjugate gradients (Silcowitz-Hansen, Niebe, Erleben 2010).
struct ConjugateParameters {
  /// A check at which the error is so many times that of the check before, > 1, ends them.
  double hopeless_growth = 4;
  /// Plain sweeps that one sweep is worth, >= 1: a column of 100 grains takes 37,912 and 964.
  double speed = 40;
};

/// The ratio of Fletcher and Reeves.
struct ConjugateGradient {
  double beta = 0;     ///< of the next sweep, in [0, 1]; 0: a new start
  double change2 = 0;  ///< of the last sweep [J]

  /// The next beta, from the squared change of a sweep and that of the sweep before.
  void turn(double changed2) {
    beta = change2 > 0 && changed2 <= change2 ? changed2 / change2 : 0;
    change2 = changed2;
  }
};

/// How many plain sweeps one sweep of the plan is worth in a stiff problem: (1 + beta)/(1 - beta) with
/// momentum.
double speed_of(const SweepPlan& plan, const ConjugateParameters& conjugate = {});

}  // namespace talus
