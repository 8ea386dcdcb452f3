#pragma once

/// Interface of the kernels of the narrow phase: plain pointers, and no functions. The translation unit of an
/// instruction set must include no function that the linker could keep, in that version, for all processors.
/// (Spaces are always inlined.)

#include <cstddef>
#include <cstdint>

#include "kernels/bodies/record.hpp"
#include "kernels/detection/separation.hpp"

namespace talus {

struct GapRule;

/// Pairs of grains whose gaps are to be found.
struct PairView {
  const double* x;                      ///< 3 per body: its centre [m]
  const double* radius;                 ///< 1 per body [m]
  const double* velocity;               ///< record_numbers per body: its record
  const std::uint32_t *first, *second;  ///< per pair: where the records of its bodies begin, in numbers
  std::size_t count;                    ///< of pairs
  const double* restitution = nullptr;  ///< per pair; null: all have that of the rule, and its reach
  const double* reach = nullptr;        ///< likewise (GapRule::reach)
  const PeriodicSpace* cell = nullptr;  ///< null: between walls
  const EdgeRates* rates = nullptr;     ///< null: the cell does not change
};

/// Results of the search, per pair.
struct GapTarget {
  double *nx, *ny, *nz, *bias;
  std::int64_t* contact;  ///< -1 for contacts, 0 for others
};

/// Fills `GapTarget`. True when the two bodies of some pair have moved against one another by half the
/// smaller radius or more within the last time step.
using FindGaps = bool (*)(const PairView&, const GapRule&, const GapTarget&);

/// Constants: a function that returns them might itself use instructions that the processor does not have.
extern const FindGaps gap_kernels_portable;
extern const FindGaps gap_kernels_avx2;
extern const FindGaps gap_kernels_avx512;

}  // namespace talus
