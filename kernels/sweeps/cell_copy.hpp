#pragma once

/// A periodic cell that follows a stress is one more body: all contacts push it (docs/theory.md, "Cells under
/// stress"). Its velocity is what the gradient G of its flow gains in the step, times a length d: U = d G
/// [m/s], in the order xx, yy, zz, xy, xz, yz of an upper triangular G; and its mass is one of grains [kg]. A
/// contact with the branch b, from the second body to the first, moves with U b/d beside its bodies, and an
/// impulse r gives the cell r (x) b/d: symmetric, as of any body.

#include <array>
#include <cstddef>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/sweeps/sweep.hpp"

namespace talus {

inline constexpr std::size_t cell_freedoms = 6;
using CellVelocity = std::array<double, cell_freedoms>;  ///< [m/s]; or momentum [N s]

/// A chunk's own instance of the cell, as WallCopy is of a wall: of k copies each has a k-th of the mass.
struct CellCopy {
  CellVelocity velocity{};
  CellVelocity inv_mass{};  ///< k/M of each component [1/kg]; 0 where the flow is prescribed
};

/// G = U/d of velocities, as a matrix [1/s].
Mat3 gradient_of(const CellVelocity& velocity, double length);
/// xx, yy, zz, xy, xz, yz of a matrix.
CellVelocity components_of(const Mat3& matrix);

/// U b/d at a contact whose branch over d is `branch`.
Vec3 velocity_at(const CellVelocity& velocity, const Vec3& branch);
/// r (x) b/d is added to `impulse`.
void add_impulse(const Vec3& r, const Vec3& branch, CellVelocity& impulse);

/// The sum of r (x) b/d over the contacts of a range [N s], of what they do to their bodies: cohesion counts.
CellVelocity impulse_on_cell(const Contacts& contacts, ContactRange range);

}  // namespace talus
