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

/// The dual problem, in impulses times sqrt(W_cc): y = W s + q, s >= 0, y >= 0, s.y = 0, diagonal of W 1.
struct Dual {
  Matrix W;
  Vector q;
  Vector scale;  ///< s_c = r_n / scale_c, with scale_c = W_cc^-1/2
};

Dual dual_of(const StepProblem& problem) {
  const auto contacts = static_cast<Eigen::Index>(problem.contacts.size());
  const auto grains = static_cast<Eigen::Index>(problem.mass.size());
  const auto walls = static_cast<Eigen::Index>(problem.wall_normal.size());
  Dual dual;
  dual.q.resize(contacts);
  dual.scale.resize(contacts);
  std::vector<Eigen::Triplet<Real>> entries;
  for (Eigen::Index c = 0; c < contacts; ++c) {
    const StepContact& contact = problem.contacts[static_cast<std::size_t>(c)];
    std::vector<Eigen::Triplet<Real>> row;
    const auto add = [&](std::size_t body, Real sign) {
      const Real root = std::sqrt(1 / static_cast<Real>(problem.mass[body]));
      for (Eigen::Index k = 0; k < 3; ++k)
        row.emplace_back(c, 3 * static_cast<Eigen::Index>(body) + k,
                         sign * root * static_cast<Real>(contact.normal[k]));
    };
    add(contact.first, 1);
    if (!contact.at_wall())
      add(contact.other(), -1);
    else if (problem.wall_inv_mass[contact.wall()] > 0)
      row.emplace_back(c, 3 * grains + static_cast<Eigen::Index>(contact.wall()),
                       -std::sqrt(static_cast<Real>(problem.wall_inv_mass[contact.wall()])));
    Real square = 0;
    for (const auto& entry : row) square += entry.value() * entry.value();
    dual.scale[c] = 1 / std::sqrt(square);
    for (const auto& entry : row) entries.emplace_back(c, entry.col(), entry.value() * dual.scale[c]);
    // In 80 bits from the start: b and v_free nearly cancel at a contact that hardly moves.
    Eigen::Matrix<Real, 3, 1> v = problem.free.u[contact.first].cast<Real>();
    v -= (contact.at_wall() ? problem.free.walls[contact.wall()] : problem.free.u[contact.other()])
             .cast<Real>();
    dual.q[c] = dual.scale[c] * (contact.normal.cast<Real>().dot(v) + static_cast<Real>(contact.bias));
  }
  Matrix G(contacts, 3 * grains + walls);
  G.setFromTriplets(entries.begin(), entries.end());
  dual.W = G * Matrix(G.transpose());
  return dual;
}

/// Solves y = (W + shift) s + q, s >= 0 only on the rows of `carry`, y >= 0 elsewhere.
class Pivots {
 public:
  Pivots(const Matrix& W, const Vector& q, Real shift, int most)
      : W_(W), q_(q), shift_(shift), most_(most), place_(Rows(static_cast<std::size_t>(q.size()), -1)) {}

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
      for (Matrix::InnerIterator at(W_, c); at; ++at) {
        const Eigen::Index row = place_[static_cast<std::size_t>(at.row())];
        if (row >= k) entries.emplace_back(row, k, at.value() + (row == k ? shift_ : 0));
      }
    }
    Matrix block(size, size);
    block.setFromTriplets(entries.begin(), entries.end());
    Eigen::SimplicialLDLT<Matrix, Eigen::Lower> factor(block);
    if (factor.info() != Eigen::Success) return false;
    Vector part = factor.solve(right);
    part += factor.solve(right - block.selfadjointView<Eigen::Lower>() * part);
    for (Eigen::Index k = 0; k < size; ++k) s[rows_[static_cast<std::size_t>(k)]] = part[k];
    return true;
  }

  /// Contacts that carry and pull, and contacts that do not carry and close.
  Rows misplaced(const std::vector<char>& carry, const Vector& s) const {
    const Vector y = W_ * s + q_;
    const Real size = std::max(s.cwiseAbs().maxCoeff(), q_.cwiseAbs().maxCoeff());
    Rows wrong;
    for (Eigen::Index c = 0; c < q_.size(); ++c)
      if (carry[static_cast<std::size_t>(c)] ? s[c] < -pull * size : y[c] < -close * size) wrong.push_back(c);
    return wrong;
  }

  const Matrix& W_;
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
  const Vector y = dual.W * s + dual.q;
  Met met;
  for (Eigen::Index c = 0; c < s.size(); ++c) {
    met.residual = std::max(met.residual, std::abs(s[c] - std::max<Real>(0, s[c] - y[c])));
    met.gap += std::abs(s[c] * y[c]);
  }
  return met;
}

/// Proximal steps from s, in and out, until the law is met to `enough`. False when pivots do not end.
bool find_impulses(const Dual& dual, const ReferenceLimits& limits, Real enough, Vector& s) {
  std::vector<char> carry;
  for (const Real value : s) carry.push_back(value > 0);
  Vector next;
  Real shift = first_shift, residual = met_by(dual, s).residual;
  for (int step = 0; step < limits.proximal_steps && residual > enough; ++step) {
    const Vector q = dual.q - shift * s;
    if (!Pivots(dual.W, q, shift, limits.pivots).solve(carry, next)) return false;
    s = next.cwiseMax(Real{0});
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
  const auto kinetic2 = [&](const Vector& s) { return s.dot(dual.W * s); };
  const Real apart2 = limits.forces_velocities * limits.forces_velocities *
                      std::max(kinetic2(answer),
                               floor_of_exchange * floor_of_exchange * answer.maxCoeff() * answer.maxCoeff());
  Vector next;
  for (Real shift = nearest_shift; shift >= least_shift; shift /= 10) {
    if (!Pivots(dual.W, dual.q - shift * start, shift, limits.pivots).solve(carry, next)) return answer;
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

double unavoidable_approach(const StepProblem& problem, const ReferenceLimits& limits) {
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
      std::max(std::sqrt(std::max<Real>(0, s.dot(dual.W * s))), floor_of_exchange * s.maxCoeff()));
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
