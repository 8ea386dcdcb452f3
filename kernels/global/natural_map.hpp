#pragma once

/// How far one contact of a problem over bodies is from its law: the natural map in De Saxce's form, with rho
/// = 1/W_nn (docs/theory.md, "Error").

#include "kernels/global/stiffness.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

/// A contact under the impulse r [N s] at the velocity v + b n [m/s], of which without friction the normal
/// part counts (`constrained_velocity`).
struct NaturalMap {
  double m;      ///< 1/W_nn [kg]
  double shift;  ///< mu |v_t| [m/s]
  Vec3 aim;      ///< r - m (v + (b + shift) n) [N s]
  Vec3 carried;  ///< the point of the cone nearest to aim [N s]: r where the law holds

  /// |r - carried| W_nn [m/s].
  double residual(const Vec3& r) const { return (r - carried).norm() / m; }
};

/// `m`: effective mass [kg].
inline NaturalMap natural_map_of(double m, const ContactEquation& c, const Vec3& r, const Vec3& velocity) {
  const double shift = c.mu * tangential(c, velocity).norm();
  const Vec3 aim = r - m * (velocity + shift * c.normal);
  return {m, shift, aim, project_on_cone(aim, c.normal, c.mu)};
}
inline NaturalMap natural_map_of(const BodyProblem& problem, const ContactEquation& c, const Vec3& r,
                                 const Vec3& velocity) {
  return natural_map_of(effective_mass(problem, c), c, r, velocity);
}

}  // namespace talus
