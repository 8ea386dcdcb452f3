#include "kernels/sweeps/cell_copy.hpp"

namespace talus {

CellVelocity impulse_on_cell(const Contacts& contacts, ContactRange range) {
  CellVelocity sum{};
  for (std::size_t k = range.begin; k < range.end; ++k) {
    const Vec3 n(contacts.nx[k], contacts.ny[k], contacts.nz[k]);
    Vec3 r =
        contacts.rx.empty() ? Vec3(contacts.rn[k] * n) : Vec3(contacts.rx[k], contacts.ry[k], contacts.rz[k]);
    if (!contacts.cohesion.empty()) r -= contacts.cohesion[k] * n;
    add_impulse(r, contacts.reach[k] * n, sum);
  }
  return sum;
}

}  // namespace talus
