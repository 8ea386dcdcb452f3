#include "runtime/step/velocity_error_memory.hpp"

#include <algorithm>
#include <cstdlib>

namespace talus {

double VelocityErrorMemory::per_work(const Problem& problem, bool friction) const {
  const bool holds =
      sweeps_ >= 0 &&
      reuse_.same_contacts * std::abs(problem.contacts - problem_.contacts) <= problem_.contacts &&
      problem.exchanged <= reuse_.same_energy * problem_.exchanged &&
      problem_.exchanged <= reuse_.same_energy * problem.exchanged;
  if (!holds) return reuse_.most;
  const double least = friction ? reuse_.least_sliding : reuse_.least;
  return std::clamp(reuse_.caution * std::max(last_, before_), least, reuse_.most);
}

void VelocityErrorMemory::found(const Problem& problem, double error, double work) {
  before_ = sweeps_ < 0 ? 0 : last_;
  last_ = work > 0 ? error / work : reuse_.most;
  problem_ = problem;
  sweeps_ = 0;
}

}  // namespace talus
