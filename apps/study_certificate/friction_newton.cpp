#include "apps/study_certificate/friction_newton.hpp"

#include <Eigen/Geometry>
#include <Eigen/SparseLU>

#include <algorithm>
#include <cmath>

namespace talus::audit {

namespace {

/// Added to the diagonal (1) of W in a step: more where the step would lead astray (Levenberg, Marquardt).
constexpr double least_shift = 1e-9, most_shift = 1;
/// A step has to leave no more than this part of the residual.
constexpr double progress = 0.95;
/// A residual below which a step that does not help ends the search.
constexpr double found = 1e-11;
/// Of W s + q, relative: no step makes less of it.
constexpr double rounding = 1e-15;

using Triplets = std::vector<Eigen::Triplet<double>>;

Eigen::Index row_of(std::size_t c) {
  return 3 * static_cast<Eigen::Index>(c);
}

Eigen::Matrix3d frame_of(const Vec3& n) {
  Eigen::Index least = 0;
  n.cwiseAbs().minCoeff(&least);
  Eigen::Matrix3d frame;
  frame.col(0) = n;
  frame.col(1) = n.cross(Vec3(Vec3::Unit(least))).normalized();
  frame.col(2) = n.cross(Vec3(frame.col(1)));
  return frame;
}

/// Entries of the scaled map from momenta to relative velocities of contact c: a block of a body that moves
/// or turns.
void add_body(Triplets& entries, std::size_t c, Eigen::Index column, const Eigen::Matrix3d& block) {
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      if (block(i, j) != 0) entries.emplace_back(row_of(c) + i, column + j, block(i, j));
}

}  // namespace

FrictionNewton::FrictionNewton(const StepProblem& problem) {
  const std::size_t contacts = problem.contacts.size(), grains = problem.mass.size();
  Triplets entries;
  scale_.resize(row_of(contacts));
  q_.resize(row_of(contacts));
  for (std::size_t c = 0; c < contacts; ++c) {
    const StepContact& contact = problem.contacts[c];
    const Eigen::Matrix3d frame = frame_of(contact.normal);
    double normal = 0, tangential = 0;
    const auto add_grain = [&](std::size_t k, double sign) {
      normal += 1 / problem.mass[k];
      tangential += 1 / problem.mass[k] + problem.spin_mobility[k];
      const auto column = 6 * static_cast<Eigen::Index>(k);
      Eigen::Matrix3d cross;  // v = ... - w x n = n x w
      const Vec3& n = contact.normal;
      cross << 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0;
      add_body(entries, c, column, sign * std::sqrt(1 / problem.mass[k]) * frame.transpose());
      add_body(entries, c, column + 3, std::sqrt(problem.spin_mobility[k]) * frame.transpose() * cross);
    };
    add_grain(contact.first, 1);
    if (!contact.at_wall()) {
      add_grain(contact.other(), -1);
    } else if (const double inv_mass = problem.wall_inv_mass[contact.wall()]; inv_mass > 0) {
      normal += inv_mass;
      entries.emplace_back(row_of(c), static_cast<Eigen::Index>(6 * grains + contact.wall()),
                           -std::sqrt(inv_mass));
    }
    scale_.segment<3>(row_of(c)) << 1 / std::sqrt(normal), 1 / std::sqrt(tangential),
        1 / std::sqrt(tangential);
    q_.segment<3>(row_of(c)) =
        frame.transpose() * (relative_velocity(contact, problem.free)) + Vec3(contact.bias, 0, 0);
    friction_.push_back(contact.friction * std::sqrt(tangential / normal));
    frame_.push_back(frame);
  }
  q_ = q_.cwiseProduct(scale_).eval();
  Matrix H(row_of(contacts), static_cast<Eigen::Index>(6 * grains + problem.wall_normal.size()));
  H.setFromTriplets(entries.begin(), entries.end());
  H = scale_.asDiagonal() * H;
  W_ = H * Matrix(H.transpose());
}

FrictionNewton::Vector FrictionNewton::scaled(std::span<const Vec3> r) const {
  Vector s(scale_.size());
  for (std::size_t c = 0; c < r.size(); ++c) s.segment<3>(row_of(c)) = frame_[c].transpose() * r[c];
  return s.cwiseQuotient(scale_);
}

std::vector<Vec3> FrictionNewton::unscaled(const Vector& s) const {
  std::vector<Vec3> r;
  for (std::size_t c = 0; c < frame_.size(); ++c)
    r.push_back(frame_[c] * s.segment<3>(row_of(c)).cwiseProduct(scale_.segment<3>(row_of(c))));
  return r;
}

FrictionNewton::Vector FrictionNewton::law(const Vector& s) const {
  const Vector z = s - (W_ * s + q_);
  Vector F = s;
  for (std::size_t c = 0; c < frame_.size(); ++c) {
    const Eigen::Index k = row_of(c);
    const double normal = std::max(0.0, z[k]), size = std::hypot(z[k + 1], z[k + 2]);
    const double most = friction_[c] * normal, part = size > most ? (size > 0 ? most / size : 0) : 1;
    F[k] -= normal;
    F[k + 1] -= part * z[k + 1];
    F[k + 2] -= part * z[k + 2];
  }
  return F;
}

double FrictionNewton::residual(const Vector& s, const Vector& F) const {
  double unit = s.cwiseAbs().maxCoeff();
  for (std::size_t c = 0; c < frame_.size(); ++c) unit = std::max(unit, -q_[row_of(c)]);
  return unit > 0 ? F.cwiseAbs().maxCoeff() / unit : 0;
}

/// P' of contact c at z; 0 where it is open.
void FrictionNewton::derivative(const Vector& z, std::size_t c, Eigen::Matrix3d& D) const {
  const Eigen::Index k = row_of(c);
  D.setZero();
  if (z[k] <= 0) return;
  const double most = friction_[c] * z[k], size = std::hypot(z[k + 1], z[k + 2]);
  D(0, 0) = 1;
  if (size <= most) {
    D(1, 1) = D(2, 2) = friction_[c] > 0 ? 1 : 0;
  } else if (most > 0) {
    const Eigen::Vector2d d = z.segment<2>(k + 1) / size;
    D.block<2, 1>(1, 0) = friction_[c] * d;
    D.block<2, 2>(1, 1) = most / size * (Eigen::Matrix2d::Identity() - d * d.transpose());
  }
}

bool FrictionNewton::step(const Vector& s, const Vector& F, double shift, Vector& ds) const {
  const Vector z = s - (W_ * s + q_);
  const auto size = s.size();
  // Open contacts lose their impulses, which leaves a system of those that carry.
  std::vector<Eigen::Index> place(static_cast<std::size_t>(size), -1);
  Eigen::Index rows = 0;
  for (std::size_t c = 0; c < frame_.size(); ++c)
    if (z[row_of(c)] > 0)
      for (Eigen::Index i = 0; i < 3; ++i) place[static_cast<std::size_t>(row_of(c) + i)] = rows++;
  ds = -F;
  if (rows == 0) return true;
  Triplets select, derivatives;
  Eigen::Matrix3d D;
  for (std::size_t c = 0; c < frame_.size(); ++c) {
    const Eigen::Index k = row_of(c), row = place[static_cast<std::size_t>(k)];
    if (row < 0) continue;
    derivative(z, c, D);
    for (Eigen::Index i = 0; i < 3; ++i) {
      select.emplace_back(row + i, k + i, 1);
      for (Eigen::Index j = 0; j < 3; ++j)
        if (D(i, j) != 0) derivatives.emplace_back(row + i, row + j, D(i, j));
    }
  }
  Matrix S(rows, size), P(rows, rows), one(rows, rows);
  S.setFromTriplets(select.begin(), select.end());
  P.setFromTriplets(derivatives.begin(), derivatives.end());
  one.setIdentity();
  const Matrix SW = S * W_;
  Matrix J = one - P + P * Matrix(SW * Matrix(S.transpose()) + shift * one);
  J.makeCompressed();
  Vector open = ds;
  for (Eigen::Index k = 0; k < size; ++k)
    if (place[static_cast<std::size_t>(k)] >= 0) open[k] = 0;
  const Vector right = -(S * F) - P * (SW * open);
  Eigen::SparseLU<Matrix> factor(J);
  if (factor.info() != Eigen::Success) return false;
  const Vector part = factor.solve(right);
  if (!part.allFinite()) return false;
  ds = open + S.transpose() * part;
  return true;
}

double FrictionNewton::improve(std::vector<Vec3>& r, int most_steps, double& moved) const {
  Vector s = scaled(r), F = law(s), ds;
  double now = residual(s, F), shift = least_shift;
  moved = 1;
  for (int k = 0; k < most_steps && shift <= most_shift; ++k) {
    if (step(s, F, shift, ds)) {
      const double size = s.cwiseAbs().maxCoeff();
      if (shift == least_shift) moved = size > 0 ? ds.cwiseAbs().maxCoeff() / size : 0;
      if (now <= rounding) break;
      const Vector there = s + ds, F_there = law(there);
      const double after = residual(there, F_there);
      if (after <= progress * now) {
        s = there;
        F = F_there;
        now = after;
        shift = std::max(least_shift, shift / 10);
        continue;
      }
      if (now <= found) break;  // what is left is rounding
    }
    shift *= 100;
  }
  r = unscaled(s);
  return now;
}

}  // namespace talus::audit
