#pragma once

/// Sums over all contacts that are the same bits on any number of ranks: each subdomain adds up its chunks in
/// their order and makes a row of numbers; rows travel, and every rank adds them in order of subdomain.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/step/gluing.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// What a check has measured, of all subdomains.
struct CheckSums {
  ErrorSums error;  ///< all but its wall_impulse
  JumpSums jump;
  Exchanged exchanged;  ///< copies of a body count by their masses
  /// Impulse of each wall on the grains [N s]; then, in a periodic cell, the two halves of the impulse of the
  /// contacts on it (kernels/bodies/cell_velocity.hpp), whose faces carry forces as walls would.
  std::vector<Vec3> wall_impulse;
  double imbalance = 0;  ///< contacts of the fullest subdomain over those of the mean one, less 1
};

/// Length of CheckSums::wall_impulse.
std::size_t pushed_vectors(const StepState& state);
/// Doubles in the row that a subdomain sends per check.
std::size_t check_row_width(std::size_t vectors);
/// What a check has measured of each chunk.
struct ChunkErrors {
  std::span<const ErrorSums> sums;
  std::span<const CellVelocity> cell = {};  ///< impulses on a periodic cell [N s], or none
};
/// The rows of the subdomains of this rank. `jumps`: per subdomain of this rank, or empty.
std::vector<double> check_rows(const StepState& state, const ChunkErrors& errors,
                               std::span<const JumpSums> jumps);
/// Adds up the rows of all subdomains; each stands there once, in any order.
CheckSums add_check_rows(std::span<const double> rows, std::size_t vectors, std::int32_t subdomains);

/// The same for a single number per chunk, such as the size of a sweep's change.
std::vector<double> number_rows(const StepState& state, std::span<const double> numbers);
double add_number_rows(std::span<const double> rows, std::int32_t subdomains);

}  // namespace talus
