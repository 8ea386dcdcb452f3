#pragma once

/// A periodic cell that follows a stress is one more body: all contacts push it (docs/theory.md, "Cells under
/// stress"). Its velocity is what the gradient G of its flow gains in the step, times a length d: U = d G
/// [m/s], in the order xx, yy, zz, xy, xz, yz of an upper triangular G; and its mass is one of grains [kg]. A
/// contact with the branch b, from the second body to the first, moves with U b/d beside its bodies, and an
/// impulse r gives the cell r (x) b/d: symmetric, as of any body.

#include <array>
#include <cstddef>

#include "kernels/bodies/types.hpp"

namespace talus {

inline constexpr std::size_t cell_freedoms = 6;
using CellVelocity = std::array<double, cell_freedoms>;  ///< [m/s]; or momentum [N s]

/// G = U/d of velocities, as a matrix [1/s].
inline Mat3 gradient_of(const CellVelocity& u, double length) {
  Mat3 gradient;
  gradient << u[0], u[3], u[4], 0, u[1], u[5], 0, 0, u[2];
  return gradient / length;
}

/// xx, yy, zz, xy, xz, yz of a matrix.
inline CellVelocity components_of(const Mat3& m) {
  return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)};
}

/// U b/d at a contact whose branch over d is `b`.
inline Vec3 velocity_at(const CellVelocity& u, const Vec3& b) {
  return {u[0] * b[0] + u[3] * b[1] + u[4] * b[2], u[1] * b[1] + u[5] * b[2], u[2] * b[2]};
}

/// r (x) b/d is added to `impulse`.
inline void add_impulse(const Vec3& r, const Vec3& b, CellVelocity& impulse) {
  impulse[0] += r[0] * b[0];
  impulse[1] += r[1] * b[1];
  impulse[2] += r[2] * b[2];
  impulse[3] += r[0] * b[1];
  impulse[4] += r[0] * b[2];
  impulse[5] += r[1] * b[2];
}

}  // namespace talus
