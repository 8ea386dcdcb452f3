#pragma once

/// Global balance: do the impulses carry what they must? The natural map looks at one contact at a time; on
/// long chains and under heavy bodies each contact can be nearly satisfied while hardly anything of the load
/// is carried (docs/decisions/0012-stiff.md).

#include <algorithm>

namespace talus {

/// Problems of fewer sweeps are none that sweeps cannot see through.
constexpr double stiff = 300;

/// Estimate of the relative error of the forces that the walls carry, from their relative `change` over the
/// second half of `sweeps` sweeps in a problem that takes about `sweeps_needed` of them (estimate_stiffness).
/// What converges in k sweeps changes by about half of its error over k/2; over fewer it changes by that part
/// of it only, and a plate that sweeps leave falling looks still: 10^6 grain masses on a pile, k = 8e4; after
/// 1000 sweeps the force is 0.7 % of the weight, its change 0.5, and the estimate 80.
inline double unbalance(double change, int sweeps, double sweeps_needed) {
  if (sweeps_needed < stiff || sweeps == 0) return change;
  return change * std::max(1.0, 2 * sweeps_needed / sweeps);
}

}  // namespace talus
