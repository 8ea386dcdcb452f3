#include "runtime/step/stiffness_memory.hpp"

#include <cstdlib>

namespace talus {

void StiffnessMemory::renew(double spread) {
  spread_ = spread;
  ++renewals_;
}

/// A grain that has got new neighbours since may have landed, which changes the answer by no more than the
/// ratio of masses.
bool StiffnessMemory::holds(const Problem& problem, double stiff) const {
  const double could = then_ * (renewals_ > 0 ? spread_ : 1);
  const std::int64_t before = problem_.contacts;
  return grains_alike() && renewals_ <= reuse_.most_renewals && then_ >= 0 && reuse_.margin * could < stiff &&
         reuse_.same_contacts * std::abs(problem.contacts - before) <= before &&
         problem_.carrying == problem.carrying;
}

double StiffnessMemory::sweeps_needed(const Problem& problem, double stiff,
                                      const std::function<double()>& estimate) {
  if (!(now_ < 0)) return now_;
  if (!holds(problem, stiff)) {
    then_ = estimate();
    problem_ = problem;
    renewals_ = 0;
  }
  return now_ = then_;
}

}  // namespace talus
