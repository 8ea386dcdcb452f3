#include "runtime/step/error_history.hpp"

#include <algorithm>
#include <limits>

namespace talus {

void ErrorHistory::clear() {
  checks_.clear();
  start_ = patience_from_ = 0;
}

const ErrorCheck* ErrorHistory::before_last(int begun, int apart) const {
  for (std::size_t k = checks_.size() - 1; k-- > start_;) {
    if (checks_[k].iterations + 1 < begun) return nullptr;
    if (checks_[k].iterations + apart <= last().iterations) return &checks_[k];
  }
  return nullptr;
}

std::size_t ErrorHistory::last_in(int part) const {
  std::size_t from = start_;
  while (from + 1 < checks_.size() && part * checks_[from + 1].iterations <= last().iterations) ++from;
  return from;
}

bool ErrorHistory::stagnant(double tolerance, int patience, double gain) const {
  const std::size_t first = std::max(start_, patience_from_);
  const int from = checks_[first].iterations, done = last().iterations - from;
  if (done < patience) return false;
  double quarter = std::numeric_limits<double>::infinity(), half = quarter;
  for (std::size_t k = first; k < checks_.size(); ++k) {
    const int at = checks_[k].iterations - from;
    if (4 * at < done) continue;
    double& best = 2 * at < done ? quarter : half;
    best = std::min(best, checks_[k].error_rms);
  }
  return half > tolerance && half > gain * quarter;
}

}  // namespace talus
