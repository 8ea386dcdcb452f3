#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>

#include "apps/study_certificate/reference.hpp"

namespace talus::audit {

namespace {

/// 64 bits of mantissa where the processor has them: a wedge of half angle a has eigenvalues sin^2 a, a
/// straight chain in a box smaller ones, and each costs as many digits.
using Real = long double;
using Matrix = Eigen::SparseMatrix<Real>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using Dense = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Rows = std::vector<Eigen::Index>;

/// Part of W's diagonal that is added in a proximal step: the first one, and the least. It decides among
/// redundant contacts, and is undone by the next step elsewhere: what eigenvalue l of W (diagonal 1) still
/// misses shrinks by shift/(shift + l). It falls until the law is met, and no further, so that redundant
/// contacts between fixed walls, whose gaps rounding has made, are not pumped up.
constexpr Real first_shift = 1e-5L, least_shift = 1e-13L;
/// Where one next to the run's is looked for: the larger it is, the nearer it stays.
constexpr Real nearest_shift = 10;

/// The law is met to this part of the residual that is enough: it comes at no cost.
constexpr Real sharpness = 1e-4L;
/// Least momentum exchanged, kinetic norm, over the largest impulse.
constexpr Real floor_of_exchange = 1e-2L;
/// Of the interior point method: steps at most; s y at its end, over its scale; part of the way to the border
/// that a step goes.
constexpr int steps_within = 80;
constexpr Real least_product = 1e-26L, to_the_border = 0.99L;

/// The dual problem, in impulses times sqrt(W_cc): y = W s + q, s >= 0, y >= 0, s.y = 0, diagonal of W 1.
struct Dual {
  Matrix W;    ///< without what a cell that follows a stress adds, cell cell^T
  Dense cell;  ///< a column per component of its flow: it ties all contacts together
  Vector q;
  Vector scale;  ///< s_c = r_n / scale_c, with scale_c = W_cc^-1/2

  Vector times_w(const Vector& s) const { return W * s + cell * (cell.transpose() * s); }
};

Dual dual_of(const StepProblem& problem) {
  const auto contacts = static_cast<Eigen::Index>(problem.contacts.size());
  const auto grains = static_cast<Eigen::Index>(problem.mass.size());
  const auto walls = static_cast<Eigen::Index>(problem.wall_normal.size());
  Dual dual;
  dual.q.resize(contacts);
  dual.scale.resize(contacts);
  dual.cell.setZero(contacts, problem.cell.follows() ? 6 : 0);
  std::vector<Eigen::Triplet<Real>> entries;
  for (Eigen::Index c = 0; c < contacts; ++c) {
    const StepContact& contact = problem.contacts[static_cast<std::size_t>(c)];
    std::vector<Eigen::Triplet<Real>> row;
    const auto add = [&](std::size_t body, Real sign, const Mat3& lever) {
      const Real root = std::sqrt(1 / static_cast<Real>(problem.mass[body])),
                 turning = std::sqrt(static_cast<Real>(problem.spin_mobility[body]));
      const auto place = static_cast<Eigen::Index>(body);
      for (Eigen::Index k = 0; k < 3; ++k)
        row.emplace_back(c, 3 * place + k, sign * root * static_cast<Real>(contact.normal[k]));
      if (!contact.levers) return;  // normal forces do not turn spheres
      const Vec3 turn = lever.transpose() * contact.normal;
      for (Eigen::Index k = 0; k < 3; ++k)
        row.emplace_back(c, 3 * grains + walls + 3 * place + k, sign * turning * static_cast<Real>(turn[k]));
    };
    const StepLevers B = levers_of(contact);
    add(contact.first, 1, B.first);
    if (!contact.at_wall())
      add(contact.other(), -1, B.second);
    else if (problem.wall_inv_mass[contact.wall()] > 0)
      row.emplace_back(c, 3 * grains + static_cast<Eigen::Index>(contact.wall()),
                       -std::sqrt(static_cast<Real>(problem.wall_inv_mass[contact.wall()])));
    if (problem.cell.follows() && !contact.at_wall()) {
      const CellVector push = push_on_cell(contact.normal, contact.branch);
      for (Eigen::Index k = 0; k < 6; ++k)
        dual.cell(c, k) = std::sqrt(static_cast<Real>(problem.cell.mobility[k])) * static_cast<Real>(push[k]);
    }
    Real square = dual.cell.row(c).squaredNorm();
    for (const auto& entry : row) square += entry.value() * entry.value();
    dual.scale[c] = 1 / std::sqrt(square);
    dual.cell.row(c) *= dual.scale[c];
    for (const auto& entry : row) entries.emplace_back(c, entry.col(), entry.value() * dual.scale[c]);
    // In 80 bits from the start: b and v_free nearly cancel at a contact that hardly moves.
    Eigen::Matrix<Real, 3, 1> v = problem.free.u[contact.first].cast<Real>();
    v -= (contact.at_wall() ? problem.free.walls[contact.wall()] : problem.free.u[contact.other()])
             .cast<Real>();
    v -= contact.drift.cast<Real>();
    if (contact.levers) {
      v += (B.first * problem.free.w[contact.first]).cast<Real>();
      if (!contact.at_wall()) v -= (B.second * problem.free.w[contact.other()]).cast<Real>();
    }
    dual.q[c] = dual.scale[c] * (contact.normal.cast<Real>().dot(v) + static_cast<Real>(contact.bias));
  }
  Matrix G(contacts, 6 * grains + walls);
  G.setFromTriplets(entries.begin(), entries.end());
  dual.W = G * Matrix(G.transpose());
  return dual;
}

/// Solves y = (W + shift) s + q, s >= 0 only on the rows of `carry`, y >= 0 elsewhere.
class Pivots {
 public:
  Pivots(const Dual& dual, const Vector& q, Real shift, int most)
      : dual_(dual),
        q_(q),
        shift_(shift),
        most_(most),
        place_(Rows(static_cast<std::size_t>(q.size()), -1)) {}

  /// `carry` in: a guess; out: the contacts that carry. False when the pivots do not end.
  bool solve(std::vector<char>& carry, Vector& s) {
    Eigen::Index best = q_.size() + 1;
    int patience = patience_at_first;
    for (int pivot = 0; pivot < most_; ++pivot) {
      if (!solve_on(carry, s)) return false;
      const Rows wrong = misplaced(carry, s);
      if (wrong.empty()) return true;
      const auto count = static_cast<Eigen::Index>(wrong.size());
      if (count < best)
        best = count, patience = patience_at_first;
      else if (--patience < 0) {
        flip(carry, wrong.back());  // Murty's least-index rule, which ends for every such matrix
        continue;
      }
      for (Eigen::Index c : wrong) flip(carry, c);
    }
    return false;
  }

 private:
  static constexpr int patience_at_first = 5;
  /// Rounding, over the largest impulse: of impulses between redundant contacts, where only the shift
  /// decides, and of speeds. What is beyond it carries or closes for good.
  static constexpr Real pull = 1e-11L, close = 1e-16L;

  static void flip(std::vector<char>& carry, Eigen::Index c) {
    char& is = carry[static_cast<std::size_t>(c)];
    is = is ? 0 : 1;
  }

  bool solve_on(const std::vector<char>& carry, Vector& s) {
    rows_.clear();
    for (Eigen::Index c = 0; c < q_.size(); ++c) {
      place_[static_cast<std::size_t>(c)] =
          carry[static_cast<std::size_t>(c)] ? static_cast<Eigen::Index>(rows_.size()) : -1;
      if (carry[static_cast<std::size_t>(c)]) rows_.push_back(c);
    }
    s.setZero(q_.size());
    const auto size = static_cast<Eigen::Index>(rows_.size());
    if (size == 0) return true;
    std::vector<Eigen::Triplet<Real>> entries;
    Vector right(size);
    for (Eigen::Index k = 0; k < size; ++k) {
      const Eigen::Index c = rows_[static_cast<std::size_t>(k)];
      right[k] = -q_[c];
      for (Matrix::InnerIterator at(dual_.W, c); at; ++at) {
        const Eigen::Index row = place_[static_cast<std::size_t>(at.row())];
        if (row >= k) entries.emplace_back(row, k, at.value() + (row == k ? shift_ : 0));
      }
    }
    Matrix block(size, size);
    block.setFromTriplets(entries.begin(), entries.end());
    Vector part;
    if (dual_.cell.cols() > 0 ? !solve_with_cell(block, right, part) : !solve_block(block, right, part))
      return false;
    for (Eigen::Index k = 0; k < size; ++k) s[rows_[static_cast<std::size_t>(k)]] = part[k];
    return true;
  }

  static bool solve_block(const Matrix& block, const Vector& right, Vector& part) {
    const Eigen::SimplicialLDLT<Matrix, Eigen::Lower> factor(block);
    if (factor.info() != Eigen::Success) return false;
    part = factor.solve(right);
    part += factor.solve(right - block.selfadjointView<Eigen::Lower>() * part);
    return true;
  }

  /// A dense block, as the cell ties all contacts together.
  bool solve_with_cell(const Matrix& block, const Vector& right, Vector& part) const {
    Dense of_cell(right.size(), dual_.cell.cols());
    for (Eigen::Index k = 0; k < right.size(); ++k)
      of_cell.row(k) = dual_.cell.row(rows_[static_cast<std::size_t>(k)]);
    const Dense all = Dense(block) + of_cell * of_cell.transpose();  // the lower half is right
    const Eigen::LDLT<Dense, Eigen::Lower> factor(all);
    if (factor.info() != Eigen::Success) return false;
    part = factor.solve(right);
    part += factor.solve(right - all.selfadjointView<Eigen::Lower>() * part);
    return true;
  }

  /// Contacts that carry and pull, and contacts that do not carry and close.
  Rows misplaced(const std::vector<char>& carry, const Vector& s) const {
    const Vector y = dual_.times_w(s) + q_;
    const Real size = std::max(s.cwiseAbs().maxCoeff(), q_.cwiseAbs().maxCoeff());
    Rows wrong;
    for (Eigen::Index c = 0; c < q_.size(); ++c)
      if (carry[static_cast<std::size_t>(c)] ? s[c] < -pull * size : y[c] < -close * size) wrong.push_back(c);
    return wrong;
  }

  const Dual& dual_;
  const Vector& q_;
  Real shift_;
  int most_;
  Rows place_, rows_;
};

/// How well impulses meet the law.
struct Met {
  Real residual = 0;  ///< natural map, the largest
  Real gap = 0;  ///< sum s |y|: |V - V*|^2 in the kinetic norm, where s stands for s* at contacts that close
};
Met met_by(const Dual& dual, const Vector& s) {
  const Vector y = dual.times_w(s) + dual.q;
  Met met;
  for (Eigen::Index c = 0; c < s.size(); ++c) {
    met.residual = std::max(met.residual, std::abs(s[c] - std::max<Real>(0, s[c] - y[c])));
    met.gap += std::abs(s[c] * y[c]);
  }
  return met;
}

/// The answer to y = (W + shift) s + q by an interior point method with predictor and corrector (Mehrotra
/// 1992), which needs no guess of what carries: to about the digits that are left where s y has come down to
/// `least_product` of its scale.
Vector from_within(const Dual& dual, const Vector& q, Real shift) {
  const Eigen::Index count = q.size();
  Dense W = Dense(dual.W) + dual.cell * dual.cell.transpose();
  W.diagonal().array() += shift;
  const Real scale = std::max(q.cwiseAbs().maxCoeff(), Real{1e-300L});
  Vector s = Vector::Constant(count, scale), y = s;
  const auto farthest = [](const Vector& at, const Vector& step) {
    Real part = 1;
    for (Eigen::Index c = 0; c < at.size(); ++c)
      if (step[c] < 0) part = std::min(part, -at[c] / step[c]);
    return part;
  };
  for (int step = 0; step < steps_within; ++step) {
    const Vector apart = W * s + q - y;
    const Real gap = s.dot(y) / static_cast<Real>(count);
    if (gap < least_product * scale * scale && apart.cwiseAbs().maxCoeff() < std::sqrt(least_product) * scale)
      break;
    Dense system = W;
    system.diagonal() += y.cwiseQuotient(s);
    const Eigen::LDLT<Dense> factor(system);
    const auto towards = [&](const Vector& products, Vector& ds, Vector& dy) {
      ds = factor.solve(products.cwiseQuotient(s) - apart);
      dy = (products - y.cwiseProduct(ds)).cwiseQuotient(s);
    };
    Vector ds, dy;
    const Vector closed = -s.cwiseProduct(y);
    towards(closed, ds, dy);
    const Real part = std::min(farthest(s, ds), farthest(y, dy));
    const Real ahead = (s + part * ds).dot(y + part * dy) / static_cast<Real>(count) / gap;
    const Vector centred =
        closed - ds.cwiseProduct(dy) + Vector::Constant(count, ahead * ahead * ahead * gap);
    towards(centred, ds, dy);
    if (!ds.allFinite() || !dy.allFinite()) break;
    const Real way = std::min(Real{1}, to_the_border * std::min(farthest(s, ds), farthest(y, dy)));
    s += way * ds;
    y += way * dy;
  }
  for (Eigen::Index c = 0; c < count; ++c)
    if (s[c] < y[c]) s[c] = 0;
  return s;
}

/// Proximal steps from s, in and out, until the law is met to `enough`. False when pivots do not end.
bool find_impulses(const Dual& dual, const ReferenceLimits& limits, Real enough, Vector& s) {
  std::vector<char> carry;
  const auto guess = [&] {
    carry.clear();
    for (const Real value : s) carry.push_back(value > 0);
  };
  guess();
  Vector next;
  Real shift = first_shift, residual = met_by(dual, s).residual;
  // Where a cell ties hundreds of contacts together pivots may go round in circles.
  bool again = dual.cell.cols() > 0;
  for (int step = 0; step < limits.proximal_steps && residual > enough; ++step) {
    const Vector q = dual.q - shift * s;
    if (Pivots(dual, q, shift, again ? limits.pivots_in_cell : limits.pivots).solve(carry, next)) {
      s = next.cwiseMax(Real{0});
    } else if (again) {
      again = false;
      s = from_within(dual, dual.q, 0);
      guess();
    } else {
      return false;
    }
    residual = met_by(dual, s).residual;
    shift = std::max(least_shift, shift / 100);
  }
  return true;
}

/// Of the answers that redundant contacts leave, one next to `start` (ReferenceLimits::forces): steps from
/// there with ever less weight on the distance. `answer` where none comes out.
Vector next_to(const Dual& dual, const ReferenceLimits& limits, Real unit, const Vector& start,
               const Vector& answer) {
  std::vector<char> carry;
  for (const Real value : answer) carry.push_back(value > 0);
  const auto kinetic2 = [&](const Vector& s) { return s.dot(dual.times_w(s)); };
  const Real apart2 = limits.forces_velocities * limits.forces_velocities *
                      std::max(kinetic2(answer),
                               floor_of_exchange * floor_of_exchange * answer.maxCoeff() * answer.maxCoeff());
  Vector next;
  const bool in_cell = dual.cell.cols() > 0;
  for (Real shift = nearest_shift; shift >= least_shift; shift /= 10) {
    const Vector q = dual.q - shift * start;
    if (!Pivots(dual, q, shift, in_cell ? limits.pivots_in_cell : limits.pivots).solve(carry, next)) {
      if (!in_cell) return answer;
      next = from_within(dual, q, shift);
    }
    next = next.cwiseMax(Real{0}).eval();
    if (met_by(dual, next).residual <= limits.forces * unit && kinetic2(next - answer) <= apart2) return next;
  }
  return answer;
}

/// What impulses and speeds of approach are compared with.
Real unit_of(const StepProblem& problem, const Dual& dual, const Vector& s, const ReferenceLimits& limits) {
  Real unit = std::max({s.maxCoeff(), (-dual.q).maxCoeff(), Real{1e-300L}});
  for (Eigen::Index c = 0; c < s.size(); ++c)
    unit = std::max<Real>(unit, limits.speeds * dual.scale[c] *
                                    speed_of_bodies(problem, problem.contacts[static_cast<std::size_t>(c)]));
  return unit;
}

}  // namespace

double unavoidable_approach(const StepProblem& given, const ReferenceLimits& limits) {
  StepProblem problem = given;
  std::erase_if(problem.contacts, &StepContact::is_moment);
  const Dual dual = dual_of(problem);
  Vector s = Vector::Zero(dual.q.size());
  const Real unit = unit_of(problem, dual, s, limits);
  find_impulses(dual, limits, sharpness * limits.residual * unit, s);
  if (s.maxCoeff() <= limits.pumped * unit) return 0;
  return static_cast<double>(met_by(dual, s).residual / unit);
}

Reference solve_smooth(const StepProblem& problem, std::span<const Vec3> run, const ReferenceLimits& limits) {
  Reference reference;
  const Dual dual = dual_of(problem);
  const Eigen::Index count = dual.q.size();
  Vector s(count);
  for (Eigen::Index c = 0; c < count; ++c) {
    const auto k = static_cast<std::size_t>(c);
    s[c] = std::max(0.0, run[k].dot(problem.contacts[k].normal)) / dual.scale[c];
  }
  const Real unit = unit_of(problem, dual, s, limits);
  const Vector start = s;
  const bool ended = find_impulses(dual, limits, sharpness * limits.residual * unit, s);
  const Met met = met_by(dual, s);
  reference.residual = static_cast<double>(met.residual / unit);
  reference.error = static_cast<double>(std::sqrt(met.gap));
  reference.exchanged = static_cast<double>(
      std::max(std::sqrt(std::max<Real>(0, s.dot(dual.times_w(s)))), floor_of_exchange * s.maxCoeff()));
  const auto impulses = [&](const Vector& of) {
    std::vector<Vec3> r;
    for (Eigen::Index c = 0; c < count; ++c)
      r.push_back(static_cast<double>(of[c] * dual.scale[c]) *
                  problem.contacts[static_cast<std::size_t>(c)].normal);
    return r;
  };
  reference.exact = impulses(s);
  reference.motion = motion_under(problem, reference.exact);
  reference.r = impulses(next_to(dual, limits, unit, start, s));
  if (s.maxCoeff() > limits.pumped * unit) {
    reference.found = Found::no_answer;
    reference.why = "no velocities are admissible";
  } else if (reference.residual <= limits.residual) {  // pivots may fail at a shift smaller than it took
    reference.found = Found::answer;
  } else {
    reference.why = ended ? "the law is not met" : "the pivots do not end";
  }
  return reference;
}

}  // namespace talus::audit
