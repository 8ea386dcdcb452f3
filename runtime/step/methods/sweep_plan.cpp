#include "runtime/step/methods/sweep_plan.hpp"

#include <algorithm>
#include <cmath>

namespace talus {

double most_momentum(const MomentumParameters& parameters, bool friction, double tolerance) {
  const MomentumParameters& p = parameters;
  if (!friction) return p.most_without_friction;
  return std::clamp(1 - p.gap * std::pow(tolerance / p.reference_tolerance, p.power), p.least_most,
                    p.largest_most);
}

double momentum_beta(const MomentumParameters& parameters, int sweep, double most) {
  const int carried = sweep - parameters.plain_sweeps;
  return carried <= 0 ? 0 : std::min(most, carried / (carried + parameters.ramp));
}

double speed_of(const SweepPlan& plan, const ConjugateParameters& conjugate) {
  switch (plan.kind) {
    case SweepKind::momentum:
      return (1 + plan.most) / (1 - plan.most);
    case SweepKind::conjugate:
      return conjugate.speed;
    case SweepKind::plain:
      break;
  }
  return 1;
}

}  // namespace talus
