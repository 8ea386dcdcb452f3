#pragma once

#include <cstdint>
#include <functional>
#include <span>

namespace talus {

/// How the ranks that share a sample put their parts together. This folder knows no MPI: whoever calls it
/// from several ranks passes in-place all-reductions, and every rank calls with the same lengths in the same
/// order. Sums are of integers and maxima are exact, so the result is the same for any number of ranks and
/// any order of summation. As it stands: one rank, nothing to do.
struct Reduction {
  std::function<void(std::span<std::int64_t>)> sum = [](std::span<std::int64_t>) {};
  std::function<void(std::span<double>)> max = [](std::span<double>) {};
  bool first = true;  ///< true on exactly one rank
};

}  // namespace talus
