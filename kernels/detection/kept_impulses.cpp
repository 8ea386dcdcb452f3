#include "kernels/detection/kept_impulses.hpp"

#include <algorithm>

namespace talus {

void KeptImpulses::push_back(std::span<const double> of) {
  values_.insert(values_.end(), of.begin(), of.begin() + static_cast<std::ptrdiff_t>(length()));
}

void KeptImpulses::set(std::size_t k, std::span<const double> of) {
  std::copy_n(of.begin(), length(), row(k).begin());
}

void KeptImpulses::append(const KeptImpulses& others) {
  values_.insert(values_.end(), others.values_.begin(), others.values_.end());
}

void KeptImpulses::swap_bodies(std::size_t k) {
  if (kind_ == ImpulseKind::normal) return;
  for (double& value : row(k)) value = -value;
}

}  // namespace talus
