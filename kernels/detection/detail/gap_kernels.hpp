#pragma once

/// How the kernels of the narrow phase are called: plain pointers, and no functions, so that the translation
/// units of instruction sets include nothing that could be kept in a version for the wrong processor.
/// (Spaces are inlined always.)

#include <cstddef>
#include <cstdint>

#include "kernels/detection/separation.hpp"

namespace talus {

struct GapRule;

/// Pairs of grains whose gaps are asked for.
struct PairView {
  const double* x;                      ///< 3 per body: its centre [m]
  const double* radius;                 ///< 1 per body [m]
  const double* velocity;               ///< 8 per body: its record
  const std::int32_t *first, *second;   ///< per pair: slots of its bodies
  std::size_t count;                    ///< of pairs
  const double* restitution = nullptr;  ///< per pair; null: all have that of the rule
  const PeriodicSpace* cell = nullptr;  ///< null: between walls
  const EdgeRates* rates = nullptr;     ///< null: the cell does not change
};

/// What is found, per pair.
struct GapTarget {
  double *nx, *ny, *nz, *bias;
  std::int64_t* contact;  ///< -1 for contacts, 0 for others
};

/// Fills `GapTarget`; true when a pair came half the smaller radius nearer on its way here, or further.
using FindGaps = bool (*)(const PairView&, const GapRule&, const GapTarget&);

/// Constants: calling a function to see what there is would run instructions that the processor may not have.
extern const FindGaps gap_kernels_portable;
extern const FindGaps gap_kernels_avx2;
extern const FindGaps gap_kernels_avx512;

}  // namespace talus
