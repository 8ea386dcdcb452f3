#include "kernels/sweeps/cell_copy.hpp"

namespace talus {

Mat3 gradient_of(const CellVelocity& u, double length) {
  Mat3 gradient;
  gradient << u[0], u[3], u[4], 0, u[1], u[5], 0, 0, u[2];
  return gradient / length;
}

CellVelocity components_of(const Mat3& m) {
  return {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)};
}

Vec3 velocity_at(const CellVelocity& u, const Vec3& b) {
  return {u[0] * b[0] + u[3] * b[1] + u[4] * b[2], u[1] * b[1] + u[5] * b[2], u[2] * b[2]};
}

void add_impulse(const Vec3& r, const Vec3& b, CellVelocity& impulse) {
  impulse[0] += r[0] * b[0];
  impulse[1] += r[1] * b[1];
  impulse[2] += r[2] * b[2];
  impulse[3] += r[0] * b[1];
  impulse[4] += r[0] * b[2];
  impulse[5] += r[1] * b[2];
}

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
