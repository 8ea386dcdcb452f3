#pragma once

/// The Coulomb cone and the law of one contact with a full 3x3 block.
///
/// Vectors of a contact are (normal, tangent 1, tangent 2). r is the impulse [N s], r_N > 0 in compression; u
/// the relative velocity [m/s], u_N > 0 in separation. The law, for a friction coefficient mu >= 0 (De Saxce
/// and Feng 1998):
///
///     K_mu = { r : |r_T| <= mu r_N },      K_mu  contains r,   orthogonal to   u + mu |u_T| n,   contained
///     in  K_mu*
///
/// It is non-associated: without the term mu |u_T| n a sliding contact would dilate.

#include <Eigen/Core>

#include "kernels/bodies/types.hpp"

namespace talus {

/// Orthogonal projection on K_mu. mu >= 0 and finite, without an upper limit.
Vec3 project_on_cone(const Vec3& z, double mu);
/// The same in space, on the cone about the unit vector n.
Vec3 project_on_cone(const Vec3& z, const Vec3& n, double mu);

/// The De Saxce velocity u + mu |u_T| n [m/s].
Vec3 de_saxce_velocity(const Vec3& u, double mu);

/// Natural map of the law, r - P_Kmu(r - rho (u + mu |u_T| n)) [N s]: zero if and only if (r, u) satisfies
/// it, for any rho > 0 [kg]. The caller chooses rho, and with it how an error in velocity weighs against one
/// in impulse.
Vec3 natural_map(const Vec3& r, const Vec3& u, double mu, double rho);

enum class LocalStatus {
  open,   ///< r = 0
  stick,  ///< u = 0
  slide,  ///< u_N = 0, r_T = -mu r_N u_T / |u_T|
  failed  ///< the block and q admit no solution (or rounding hides it): r is a projected step from the guess,
          ///< for the caller to count
};

struct LocalSolution {
  Vec3 r;  ///< [N s]
  LocalStatus status;
};

/// The block of a contact, with what of it stays the same from one sweep to the next.
/// Everything is divided by W_NN, so that nothing depends on units.
struct LocalBlock {
  Mat3 W = Mat3::Zero();  ///< [1/kg]
  double mu = 0;
  Eigen::Vector2d row = Eigen::Vector2d::Zero();     ///< W_NT / W_NN
  Eigen::Vector2d column = Eigen::Vector2d::Zero();  ///< W_TN / W_NN
  Eigen::Matrix2d schur = Eigen::Matrix2d::Zero();   ///< (W_TT - W_TN W_NT / W_NN) / W_NN
  double schur_trace = 0;
  double schur_det = 0;   ///< exactly 0 when rounding cannot tell it from 0
  double compliance = 0;  ///< largest absolute entry of W [1/kg]
};

/// Prepares a block. W need be neither symmetric nor regular; a contact law makes sense for positive
/// semi-definite ones, others are tried. mu >= 0; W and mu finite.
LocalBlock local_block(const Mat3& W, double mu);

/// Finds r, with u = W r + q, in the law. q [m/s]; `guess` [N s] only starts the iteration.
///
/// Open and sticking contacts are closed forms. For sliding, u_T = -alpha W_NN r_T with alpha > 0;
/// eliminating r_N leaves a 2x2 system for r_T(alpha), and |r_T| = mu r_N one scalar equation in alpha: the
/// quartic of Bonnefon and Daviet (2011, "Quartic formulation of Coulomb 3D frictional contact"). For
/// positive semi-definite W it changes sign between alpha = 0 (the contact does not stick) and infinity, so
/// Newton's method kept inside a bracket always ends. Otherwise all roots of the quartic are tried. About 60
/// flops when open or sticking, 40 more per Newton iteration.
LocalSolution solve_local(const LocalBlock& block, const Vec3& q, const Vec3& guess);

}  // namespace talus
