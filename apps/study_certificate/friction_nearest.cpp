#include <Eigen/Dense>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/study_certificate/friction_newton.hpp"

namespace talus::audit {

namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;
using Vec2 = Eigen::Vector2d;
using Entries = Eigen::Matrix<double, 5, 1>;  ///< of a contact: normal, two across it, two of its moment

/// Of Newton's method on the multipliers.
struct DualSearch {
  int steps = 200, halvings = 30;  ///< of each step
  double decrease = 1e-4;          ///< part of the predicted decrease that a step must give
  /// Added to the diagonal of the Hessian, as a part of that of A A^T: redundant bodies leave it singular.
  double least_damping = 1e-9, most_damping = 1e-2;
};
constexpr DualSearch search;

/// What bounds a tangential impulse, or a moment, by the normal impulse: a disc, or where it slides the ray
/// against the slip.
struct Bound {
  double friction = 0;
  bool slides = false;
  Vec2 direction = Vec2::Zero();  ///< of the impulse where it slides
};

/// The impulses of one contact that have the law's answer for given velocities: a convex cone.
struct Cone {
  bool closed = false;
  std::array<Bound, 2> bound;  ///< of friction, and of the moment of rolling resistance
  int bounds = 1;              ///< 2 where there is such a moment
};

/// The nearest place of the cone to a point and its derivative by that, which is symmetric.
struct Nearest {
  Entries place = Entries::Zero();
  Eigen::Matrix<double, 5, 5> D = Eigen::Matrix<double, 5, 5>::Zero();
};

/// The normal part solves r - a = sum of mu (|t| - mu r) over the bounds that hold t back: a rising, concave
/// function of r, so that from all bounds on the set of those only shrinks.
Nearest nearest_of(const Cone& cone, const Entries& from) {
  Nearest found;
  if (!cone.closed) return found;
  std::array<bool, 2> holds{true, cone.bounds == 2};
  std::array<double, 2> size{};
  for (int k = 0; k < cone.bounds; ++k) {
    const Bound& bound = cone.bound[static_cast<std::size_t>(k)];
    const Vec2 t = from.segment<2>(1 + 2 * k);
    size[static_cast<std::size_t>(k)] = bound.slides ? bound.direction.dot(t) : t.norm();
  }
  double normal = 0, share = 1;
  for (int pass = 0; pass <= cone.bounds; ++pass) {
    double sum = from[0];
    share = 1;
    for (std::size_t k = 0; k < 2; ++k)
      if (holds[k]) {
        sum += cone.bound[k].friction * size[k];
        share += cone.bound[k].friction * cone.bound[k].friction;
      }
    normal = sum / share;
    bool shrinks = false;
    for (std::size_t k = 0; k < 2; ++k)
      if (holds[k] && !cone.bound[k].slides && cone.bound[k].friction > 0 &&
          size[k] <= cone.bound[k].friction * normal)
        holds[k] = false, shrinks = true;
    if (!shrinks) break;
  }
  if (normal <= 0) return found;
  Entries rises = Entries::Zero();  // of the normal part
  rises[0] = 1;
  for (int k = 0; k < cone.bounds; ++k) {
    const auto own = static_cast<std::size_t>(k);
    const Vec2 t = from.segment<2>(1 + 2 * k);
    if (!holds[own]) {
      found.place.segment<2>(1 + 2 * k) = t;
      found.D.block<2, 2>(1 + 2 * k, 1 + 2 * k).setIdentity();
      continue;
    }
    const Bound& bound = cone.bound[own];
    const Vec2 d = bound.slides ? bound.direction : Vec2(t / std::max(size[own], 1e-300));
    rises.segment<2>(1 + 2 * k) = bound.friction * d;
    found.place.segment<2>(1 + 2 * k) = bound.friction * normal * d;
    if (!bound.slides && size[own] > 0)
      found.D.block<2, 2>(1 + 2 * k, 1 + 2 * k) =
          bound.friction * normal / size[own] * (Eigen::Matrix2d::Identity() - d * d.transpose());
  }
  found.place[0] = normal;
  found.D += rises * rises.transpose() / share;
  return found;
}

/// All contacts' cones, and where each begins among the rows of the impulses.
struct Cones {
  std::vector<Cone> cone;
  std::vector<Eigen::Index> row;

  /// Rows of the entries of cone k, in the order of Nearest.
  std::array<Eigen::Index, 5> rows(std::size_t k) const {
    return {row[k], row[k] + 1, row[k] + 2, row[k] + 4, row[k] + 5};
  }
  std::size_t entries(std::size_t k) const { return cone[k].bounds == 2 ? 5 : 3; }

  /// The nearest place of all cones to s; D, if asked for, its derivative.
  Vector project(const Vector& s, Matrix* D) const {
    Vector place = Vector::Zero(s.size());
    std::vector<Eigen::Triplet<double>> parts;
    for (std::size_t k = 0; k < cone.size(); ++k) {
      Entries from = Entries::Zero();
      const std::array<Eigen::Index, 5> at = rows(k);
      for (std::size_t i = 0; i < entries(k); ++i) from[static_cast<Eigen::Index>(i)] = s[at[i]];
      const Nearest found = nearest_of(cone[k], from);
      for (std::size_t i = 0; i < entries(k); ++i) {
        const auto a = static_cast<Eigen::Index>(i);
        place[at[i]] = found.place[a];
        for (std::size_t j = 0; D && j < entries(k); ++j)
          if (const double d = found.D(a, static_cast<Eigen::Index>(j)); d != 0)
            parts.emplace_back(at[i], at[j], d);
      }
    }
    if (D) D->setFromTriplets(parts.begin(), parts.end());
    return place;
  }
};

/// s nearest to `run` in the cones with A s = momenta, to `enough`: s is the nearest place of the cones to
/// run + A^T x, where the multipliers x make phi(x) = |s|^2 / 2 - x . momenta least. phi is convex and
/// smooth, with gradient A s - momenta and Hessian A D A^T: Newton's method with a line search. False where
/// it does not come out.
bool project_with_momenta(const Cones& cones, const Matrix& A, const Vector& run, const Vector& momenta,
                          double enough, Vector& s) {
  const Matrix back = A.transpose();
  Vector diagonal = Matrix(A * back).diagonal();
  for (double& one : diagonal)
    if (one == 0) one = 1;  // walls that do not move, grains that nothing touches or turns
  Vector x = Vector::Zero(A.rows());
  Matrix D(run.size(), run.size());
  s = cones.project(run, nullptr);
  double phi = s.squaredNorm() / 2;
  const double first = (A * s - momenta).norm();
  for (int k = 0; k < search.steps; ++k) {
    const Vector gradient = A * s - momenta;
    const double left = gradient.norm();
    if (left <= enough) return true;
    cones.project(run + back * x, &D);
    Matrix hessian = A * D * back;
    const double damping = std::clamp(left / first, search.least_damping, search.most_damping);
    Matrix shift(A.rows(), A.rows());
    shift.setIdentity();
    shift.diagonal() = damping * diagonal;
    hessian += shift;
    const Eigen::SimplicialLDLT<Matrix> factor(hessian);
    if (factor.info() != Eigen::Success) return false;
    const Vector dx = factor.solve(-gradient);
    const double slope = gradient.dot(dx);
    if (!dx.allFinite() || !(slope < 0)) return false;
    double part = 1;
    bool falls = false;
    for (int halving = 0; halving < search.halvings && !falls; ++halving) {
      const Vector there = x + part * dx;
      s = cones.project(run + back * there, nullptr);
      const double after = s.squaredNorm() / 2 - there.dot(momenta);
      // Near the end phi is known to rounding only, and its gradient better.
      falls = after <= phi + search.decrease * part * slope || (A * s - momenta).norm() < 0.5 * left;
      if (falls) x = there, phi = after;
      part /= 2;
    }
    if (!falls) return false;
  }
  return false;
}

}  // namespace

bool FrictionNewton::keep_velocities(std::span<const Vec3> run, std::span<const Vec3> exact, const Room& room,
                                     std::vector<Vec3>& r) const {
  const Vector there = scaled(exact), v = times_w(there) + q_;
  const double still = room.law * room.unit;
  Cones cones;
  for (std::size_t c = 0; c < frame_.size(); ++c) {
    const Eigen::Index k = 3 * static_cast<Eigen::Index>(c);
    const Vec2 slip = v.segment<2>(k + 1);
    const Bound bound{friction_[c], slip.norm() > still, -slip.normalized()};
    if (carrier_[c] != c) {  // a moment
      cones.cone.back().bound[1] = bound;
      cones.cone.back().bounds = 2;
      continue;
    }
    Cone& cone = cones.cone.emplace_back();
    cone.closed = v[k] <= still;
    cone.bound[0] = bound;
    cones.row.push_back(k);
  }
  Matrix A = momenta_.transpose();
  if (cell_.cols() > 0) {
    const Matrix of_cell = cell_.transpose().sparseView();
    Matrix both(A.rows() + of_cell.rows(), A.cols());
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](const Matrix& part, Eigen::Index row) {
      for (Eigen::Index j = 0; j < part.outerSize(); ++j)
        for (Matrix::InnerIterator entry(part, j); entry; ++entry)
          entries.emplace_back(row + entry.row(), entry.col(), entry.value());
    };
    add(A, 0);
    add(of_cell, A.rows());
    both.setFromTriplets(entries.begin(), entries.end());
    A = both;
  }
  // The exact impulses may leave the cones by their residual.
  const Vector momenta = A * cones.project(there, nullptr);
  Vector s;
  if (!project_with_momenta(cones, A, scaled(run), momenta, room.velocities, s)) return false;
  if (law(s, s, 0).cwiseAbs().maxCoeff() > still) return false;
  r = unscaled(s);
  return true;
}

}  // namespace talus::audit
