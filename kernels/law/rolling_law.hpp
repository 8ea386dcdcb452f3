#pragma once

/// Rolling resistance: a contact resists rolling with a moment of at most mu_r l r_n, l being the reduced
/// radius of the two spheres, 1/l = 1/R_1 + 1/R_2, or the radius at a wall (Estrada, Taboada and Radjai 2008,
/// "Shear strength and force transmission in granular media with rolling resistance"). With w the relative
/// angular velocity in the tangent plane and m the moment's impulse on the first body,
///
///     |m| <= a r_n,   w = -lambda m with lambda >= 0 where |m| = a r_n, else w = 0,     a = mu_r l.

#include <algorithm>

#include "kernels/bodies/types.hpp"

namespace talus {

/// A contact as the law sees it.
struct Rolling {
  Vec3 rate;        ///< relative angular velocity of the first body, in the tangent plane [rad/s]
  double mobility;  ///< 1/I_1 + 1/I_2 [1/(kg m^2)] > 0
  double most;      ///< a r_n [N m s] >= 0
};

/// The nearest moment m [N m s] that a contact can carry.
inline Vec3 admissible_moment(const Vec3& m, double most) {
  const double length = m.norm();
  return length > most ? Vec3(most / length * m) : m;
}

/// The moment after m, which `rate` knows. Exact for one contact whose forces stay as they are.
inline Vec3 solve_rolling(const Vec3& m, const Rolling& contact) {
  return admissible_moment(m - contact.rate / contact.mobility, contact.most);
}

/// How far a moment is from its law, as an angular velocity [rad/s]: the natural map times the mobility.
inline double error_of_rolling(const Vec3& m, const Rolling& contact) {
  return contact.mobility * (m - solve_rolling(m, contact)).norm();
}

}  // namespace talus
