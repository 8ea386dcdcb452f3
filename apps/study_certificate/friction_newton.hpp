#pragma once

/// A semismooth Newton method for one step with friction (Alart and Curnier 1991).

#include <Eigen/SparseCore>

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "apps/study_certificate/step_problem.hpp"

namespace talus::audit {

struct NewtonResult {
  /// Largest entry of the law's residual over the largest impulse that the search began with, or the largest
  /// speed of approach, in scaled coordinates.
  double residual = 1;
  /// What one more step would change of the velocities, about their error, and what impulses change of them,
  /// at least 1e-8 of what the largest would; in the kinetic norm [J^1/2].
  double next = 1, exchanged = 1;
};

/// In coordinates s = r / scale, with scale W_nn^-1/2 along the normal and W_tt^-1/2 across it, the law of
/// all contacts is F(s) = s - P(s - (W s + q)) = 0, P the projection on r_n >= 0 and then on Coulomb's disc,
/// and W has ones on its diagonal. A proximal step replaces W s by W s + shift (s - centre), which has one
/// answer near the centre, found by Newton steps (1 - P' + P' (W + shift)) ds = -F; that answer is the next
/// centre. Redundant contacts stay where they are; what belongs to an eigenvalue l of W shrinks by
/// shift/(shift + l). The shift falls only while the residual does so too slowly: so the answer found is near
/// the beginning.
class FrictionNewton {
 public:
  /// `speeds`: least unit of residuals over the speeds of bodies (ReferenceLimits).
  FrictionNewton(const StepProblem& problem, double speeds);

  /// What residuals are compared with: the largest of the impulses r, or speed of approach, scaled.
  double unit(std::span<const Vec3> r) const;
  /// Of the law at r, the largest entry over `unit`.
  double residual(std::span<const Vec3> r, double unit) const;
  /// Proximal steps from r, in and out, until the residual over `unit` is `enough`, at most `most`.
  struct Goal {
    double unit, enough;
    int most;
    double pumped;  ///< ReferenceLimits::pumped
  };
  NewtonResult improve(std::vector<Vec3>& r, const Goal& goal) const;
  /// Of the impulses that meet the law to `enough` over `unit`, as redundant contacts leave many, those next
  /// to `run`: proximal steps about them with ever smaller shifts. False where none come out, and r stays.
  bool go_next_to(std::span<const Vec3> run, std::vector<Vec3>& r, double unit, double enough) const;
  /// What impulses may be off by: the law over a unit, and velocities [J^1/2].
  struct Room {
    double law, unit, velocities;
  };
  /// Of all impulses under which bodies move as under `exact`, and that have the law's answer to that motion,
  /// those nearest to `run`. That is a convex problem: a contact that moves apart has none, one that slides
  /// has them against its slip, any other in its cone. False where it is not solved, and r stays.
  bool keep_velocities(std::span<const Vec3> run, std::span<const Vec3> exact, const Room& room,
                       std::vector<Vec3>& r) const;
  /// Difference of the velocities under two sets of impulses, in the kinetic norm [J^1/2].
  double apart(std::span<const Vec3> a, std::span<const Vec3> b) const;

 private:
  using Matrix = Eigen::SparseMatrix<double>;
  using Vector = Eigen::VectorXd;
  struct Near {
    const Vector& centre;
    double shift;
  };

  Vector times_w(const Vector& s) const { return W_ * s + cell_ * (cell_.transpose() * s); }
  /// (s.W s)^1/2, the kinetic norm of what impulses s change. The product itself may be rounding, and even
  /// negative, where impulses press against one another by far more than they move.
  double moves(const Vector& s) const {
    return std::hypot((momenta_.transpose() * s).norm(), (cell_.transpose() * s).norm());
  }
  Vector scaled(std::span<const Vec3> r) const;
  std::vector<Vec3> unscaled(const Vector& s) const;
  Vector law(const Vector& s, const Vector& centre, double shift) const;
  void derivative(const Vector& z, std::size_t c, Eigen::Matrix3d& D) const;
  /// x = (J + P S cell (S cell)^T)^-1 x, S what selects the contacts that carry: by Woodbury's formula, which
  /// the stress that a packing holds by itself may leave without digits, and then with all of the matrix.
  bool solve_with_cell(const Matrix& J, const Matrix& P, const Matrix& S, Vector& x) const;
  /// A Newton step; false when its system has no solution.
  bool step(const Vector& s, const Vector& F, const Near& near, Vector& ds) const;
  /// Solves the problem around a centre to |F| <= enough.
  bool solve_near(const Vector& centre, double shift, double enough, Vector& s) const;

  std::vector<Eigen::Matrix3d> frame_;  ///< columns normal and two tangents, of each contact
  std::vector<double> friction_;        ///< in scaled coordinates
  std::vector<std::size_t> carrier_;    ///< whose normal part bounds it: itself, or of a moment its contact
  Vector scale_, q_;                    ///< 3 per contact
  double least_unit_ = 1e-300;
  Matrix momenta_;        ///< H: from momenta of bodies over the root of mass or inertia to velocities
  Matrix W_;              ///< H H^T, without what the cell adds, cell_ cell_^T
  Eigen::MatrixXd cell_;  ///< a column per component that follows a stress: it ties all contacts together
};

}  // namespace talus::audit
