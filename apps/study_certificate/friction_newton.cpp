#include "apps/study_certificate/friction_newton.hpp"

#include <Eigen/Dense>
#include <Eigen/SparseLU>

#include <algorithm>
#include <cmath>

namespace talus::audit {

namespace {

/// Added to the diagonal (1) of W: the first one, and its limits. It is made smaller where steps are slow,
/// and larger where they lead astray.
constexpr double first_shift = 1e-3, least_shift = 1e-10, most_shift = 10;
/// Of Newton's steps around one centre.
constexpr int inner_steps = 40, halvings = 4;
/// Part of the law's residual to which a problem around a centre is solved.
constexpr double inner_part = 1e-2;
/// Least momentum exchanged, kinetic norm, over the largest impulse: as little as errors are judged by
/// (ErrorUnits::walls), as friction may press by far more than all that moves.
constexpr double floor_of_exchange = 1e-8;
/// Of a system with a cell, solved by parts: so many refinements at most, until so much of its right side is
/// left.
constexpr int refinements = 4;
constexpr double left_of_system = 1e-9;

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

/// x = J^-1 x.
bool solve_in_place(const Eigen::SparseMatrix<double>& J, Eigen::VectorXd& x) {
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(J);
  if (factor.info() != Eigen::Success) return false;
  x = factor.solve(x).eval();
  return x.allFinite();
}

}  // namespace

FrictionNewton::FrictionNewton(const StepProblem& problem, double speeds) {
  const std::size_t contacts = problem.contacts.size(), grains = problem.mass.size();
  Triplets entries;
  cell_.setZero(row_of(contacts), problem.cell.follows() ? 6 : 0);
  scale_.resize(row_of(contacts));
  q_.resize(row_of(contacts));
  for (std::size_t c = 0; c < contacts; ++c) {
    const StepContact& contact = problem.contacts[c];
    const Eigen::Matrix3d frame = frame_of(contact.normal);
    const bool moment = contact.is_moment();
    double normal = 0, tangential = 0;
    const StepLevers B = levers_of(contact);
    const auto add_grain = [&](std::size_t k, double sign, const Mat3& lever) {
      const Eigen::Matrix3d turn = frame.transpose() * lever;
      const double mobility = problem.spin_mobility[k];
      const double inv_mass = moment ? 0 : 1 / problem.mass[k];
      normal += inv_mass + mobility * turn.row(0).squaredNorm();
      tangential += inv_mass + mobility * std::max(turn.row(1).squaredNorm(), turn.row(2).squaredNorm());
      const auto column = 6 * static_cast<Eigen::Index>(k);
      add_body(entries, c, column, sign * std::sqrt(inv_mass) * frame.transpose());
      add_body(entries, c, column + 3, sign * std::sqrt(mobility) * turn);
    };
    add_grain(contact.first, 1, B.first);
    if (!contact.at_wall()) {
      add_grain(contact.other(), -1, B.second);
    } else if (const double inv_mass = problem.wall_inv_mass[contact.wall()]; inv_mass > 0 && !moment) {
      normal += inv_mass;
      entries.emplace_back(row_of(c), static_cast<Eigen::Index>(6 * grains + contact.wall()),
                           -std::sqrt(inv_mass));
    }
    if (problem.cell.follows() && !contact.at_wall() && !moment) {
      const double of_cell = cell_mobility(problem.cell, contact.branch);
      normal += of_cell;
      tangential += of_cell;
      for (Eigen::Index k = 0; k < 6; ++k)
        cell_.block<3, 1>(row_of(c), k) =
            std::sqrt(problem.cell.mobility[k]) *
            (frame.transpose() * stretched(CellVector::Unit(k), contact.branch));
    }
    if (moment) normal = 1;  // it has no normal part
    const double own = 1 / std::sqrt(normal), across = 1 / std::sqrt(tangential);
    scale_.segment<3>(row_of(c)) << own, across, across;
    carrier_.push_back(moment ? c - 1 : c);
    q_.segment<3>(row_of(c)) =
        frame.transpose() * (relative_velocity(contact, problem.free)) + Vec3(contact.bias, 0, 0);
    friction_.push_back(contact.friction * scale_[row_of(carrier_[c])] / across);
    frame_.push_back(frame);
    if (!moment)
      least_unit_ = std::max(least_unit_, speeds * speed_of_bodies(problem, contact) / std::sqrt(normal));
  }
  q_ = q_.cwiseProduct(scale_).eval();
  momenta_.resize(row_of(contacts), static_cast<Eigen::Index>(6 * grains + problem.wall_normal.size()));
  momenta_.setFromTriplets(entries.begin(), entries.end());
  momenta_ = scale_.asDiagonal() * momenta_;
  W_ = momenta_ * Matrix(momenta_.transpose());
  cell_ = (scale_.asDiagonal() * cell_).eval();
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

FrictionNewton::Vector FrictionNewton::law(const Vector& s, const Vector& centre, double shift) const {
  const Vector z = s - (times_w(s) + q_ + shift * (s - centre));
  Vector F = s;
  for (std::size_t c = 0; c < frame_.size(); ++c) {
    const Eigen::Index k = row_of(c);
    const double normal = std::max(0.0, z[row_of(carrier_[c])]), size = std::hypot(z[k + 1], z[k + 2]);
    const double most = friction_[c] * normal, part = size > most ? (size > 0 ? most / size : 0) : 1;
    if (carrier_[c] == c) F[k] -= normal;
    F[k + 1] -= part * z[k + 1];
    F[k + 2] -= part * z[k + 2];
  }
  return F;
}

double FrictionNewton::unit(std::span<const Vec3> r) const {
  const Vector s = scaled(r);
  double size = std::max(least_unit_, s.cwiseAbs().maxCoeff());
  for (std::size_t c = 0; c < frame_.size(); ++c) size = std::max(size, -q_[row_of(c)]);
  return size;
}

/// P' of contact c at z; 0 where it is open. The first column is by the normal part of what it belongs to.
void FrictionNewton::derivative(const Vector& z, std::size_t c, Eigen::Matrix3d& D) const {
  const Eigen::Index k = row_of(c);
  const double normal = z[row_of(carrier_[c])];
  D.setZero();
  if (normal <= 0) return;
  const double most = friction_[c] * normal, size = std::hypot(z[k + 1], z[k + 2]);
  D(0, 0) = carrier_[c] == c ? 1 : 0;
  if (size <= most) {
    D(1, 1) = D(2, 2) = friction_[c] > 0 ? 1 : 0;
  } else if (most > 0) {
    const Eigen::Vector2d d = z.segment<2>(k + 1) / size;
    D.block<2, 1>(1, 0) = friction_[c] * d;
    D.block<2, 2>(1, 1) = most / size * (Eigen::Matrix2d::Identity() - d * d.transpose());
  }
}

bool FrictionNewton::solve_with_cell(const Matrix& J, const Matrix& P, const Matrix& S, Vector& x) const {
  const Eigen::MatrixXd back = S * cell_, there = P * back;
  const Vector right = x;
  const Eigen::SparseLU<Matrix> factor(J);
  if (factor.info() == Eigen::Success) {
    const Eigen::MatrixXd beside = factor.solve(there);
    const Eigen::PartialPivLU<Eigen::MatrixXd> small(Eigen::MatrixXd::Identity(back.cols(), back.cols()) +
                                                     back.transpose() * beside);
    x.setZero();
    for (int k = 0; k < refinements; ++k) {
      const Vector left = right - J * x - there * (back.transpose() * x);
      if (k > 0 && left.norm() <= left_of_system * right.norm()) return x.allFinite();
      const Vector alone = factor.solve(left);
      x += alone - beside * small.solve(back.transpose() * alone);
    }
  }
  const Eigen::PartialPivLU<Eigen::MatrixXd> whole(Eigen::MatrixXd(J) + there * back.transpose());
  x = whole.solve(right);
  return x.allFinite();
}

bool FrictionNewton::step(const Vector& s, const Vector& F, const Near& near, Vector& ds) const {
  const auto& [centre, shift] = near;
  const Vector z = s - (times_w(s) + q_ + shift * (s - centre));
  const auto size = s.size();
  // Open contacts lose their impulses, which leaves a system of those that carry.
  std::vector<Eigen::Index> place(static_cast<std::size_t>(size), -1);
  Eigen::Index rows = 0;
  for (std::size_t c = 0; c < frame_.size(); ++c)
    if (z[row_of(carrier_[c])] > 0)
      for (Eigen::Index i = 0; i < 3; ++i) place[static_cast<std::size_t>(row_of(c) + i)] = rows++;
  ds = -F;
  if (rows == 0) return true;
  Triplets select, derivatives;
  Eigen::Matrix3d D;
  for (std::size_t c = 0; c < frame_.size(); ++c) {
    const Eigen::Index k = row_of(c), row = place[static_cast<std::size_t>(k)];
    if (row < 0) continue;
    const Eigen::Index carrier = place[static_cast<std::size_t>(row_of(carrier_[c]))];
    derivative(z, c, D);
    for (Eigen::Index i = 0; i < 3; ++i) {
      select.emplace_back(row + i, k + i, 1);
      for (Eigen::Index j = 0; j < 3; ++j)
        if (D(i, j) != 0) derivatives.emplace_back(row + i, j == 0 ? carrier : row + j, D(i, j));
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
  Vector part = -(S * F) - P * (S * times_w(open));
  if (cell_.cols() > 0 ? !solve_with_cell(J, P, S, part) : !solve_in_place(J, part)) return false;
  ds = open + S.transpose() * part;
  return true;
}

bool FrictionNewton::solve_near(const Vector& centre, double shift, double enough, Vector& s) const {
  Vector ds, F = law(s, centre, shift);
  double now = F.norm();
  for (int k = 0; k < inner_steps && now > enough; ++k) {
    if (!step(s, F, {centre, shift}, ds)) return false;
    double part = 1, after = 0;
    Vector there;
    for (int halving = 0; halving <= halvings; ++halving, part /= 2) {
      there = s + part * ds;
      F = law(there, centre, shift);
      after = F.norm();
      if (after <= (1 - part / 10) * now) break;
    }
    if (after > now) return false;
    s = there;
    now = after;
  }
  return now <= enough;
}

double FrictionNewton::residual(std::span<const Vec3> r, double unit) const {
  const Vector s = scaled(r);
  return law(s, s, 0).cwiseAbs().maxCoeff() / unit;
}

NewtonResult FrictionNewton::improve(std::vector<Vec3>& r, const Goal& goal) const {
  Vector s = scaled(r);
  NewtonResult result;
  const auto residual = [&] {
    const bool grown = s.cwiseAbs().maxCoeff() > goal.pumped * goal.unit;
    return grown ? 1 : law(s, s, 0).cwiseAbs().maxCoeff() / goal.unit;
  };
  result.residual = residual();
  double shift = first_shift;
  for (int k = 0; k < goal.most && result.residual > goal.enough && shift <= most_shift; ++k) {
    const Vector centre = s;
    if (!solve_near(centre, shift, inner_part * law(s, s, 0).norm(), s)) {
      s = centre;
      shift *= 10;
      continue;
    }
    const double after = residual();
    if (after > 0.1 * result.residual) shift = std::max(least_shift, shift / 10);
    result.residual = after;
  }
  Vector ds;
  if (step(s, law(s, s, 0), {s, least_shift}, ds)) {
    result.exchanged = std::max(moves(s), floor_of_exchange * s.cwiseAbs().maxCoeff());
    result.next = moves(ds);
  }
  r = unscaled(s);
  return result;
}

bool FrictionNewton::go_next_to(std::span<const Vec3> run, std::vector<Vec3>& r, double unit,
                                double enough) const {
  const Vector centre = scaled(run);
  Vector s = centre;
  // Large shifts hold s near the centre, and each answer leads to that of the next shift.
  for (double shift = most_shift; shift >= least_shift; shift /= 10) {
    if (!solve_near(centre, shift, inner_part * enough * unit, s)) return false;
    if (law(s, s, 0).cwiseAbs().maxCoeff() > enough * unit) continue;
    r = unscaled(s);
    return true;
  }
  return false;
}

double FrictionNewton::apart(std::span<const Vec3> a, std::span<const Vec3> b) const {
  return moves(scaled(a) - scaled(b));
}

}  // namespace talus::audit
