#pragma once

/// Copies of a periodic cell that follows a stress (kernels/bodies/cell_velocity.hpp), as sweeps see it.

#include <span>

#include "kernels/bodies/cell_velocity.hpp"
#include "kernels/detection/contacts.hpp"
#include "kernels/sweeps/sweep.hpp"

namespace talus {

/// A chunk's own instance of the cell, as WallCopy is of a wall: of k copies each has a k-th of the mass.
struct CellCopy {
  CellVelocity velocity{};
  CellVelocity inv_mass{};  ///< k/M of each component [1/kg]; 0 where the flow is prescribed
};

/// The sum of r (x) b/d over the contacts of a range [N s], of what they do to their bodies: cohesion counts.
CellVelocity impulse_on_cell(const Contacts& contacts, ContactRange range);
/// The same where contacts do not keep b, since the cell follows no stress: the sum of the radii [m] stands
/// for its length. `length`: d [m].
CellVelocity impulse_through_cell(const Contacts& contacts, ContactRange range,
                                  std::span<const double> radius, double length);

}  // namespace talus
