#include "kernels/delassus/newton.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "kernels/delassus/delassus_sweeps.hpp"
#include "kernels/delassus/detail/block_factorisation.hpp"

namespace talus {
namespace {

using Vector = Eigen::VectorXd;
using Mat2 = Eigen::Matrix2d;
using Vec2 = Eigen::Vector2d;

std::span<double> span_of(Vector& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}
std::span<const double> span_of(const Vector& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}

Eigen::Index first_row(std::size_t contact) {
  return static_cast<Eigen::Index>(3 * contact);
}

/// dF = velocity dW_c + impulse dr_c of one contact, W_c its rows of W; for an open one F = r.
struct Linearised {
  bool open = true;
  Mat3 velocity, impulse;
};

/// The map of Alart and Curnier for one contact; `slope` may be null.
Vec3 alart_curnier(const Vec3& r, const Vec3& u, double mu, Linearised* slope) {
  const Vec3 z = r - u;
  if (slope) slope->open = z[0] <= 0;
  if (z[0] <= 0) return r;
  const double length = z.tail<2>().norm(), limit = mu * z[0];
  if (length <= limit) {
    if (slope) {
      slope->velocity.setIdentity();
      slope->impulse.setZero();
    }
    return u;
  }
  const Vec2 t = z.tail<2>() / length;
  Vec3 f;
  f[0] = u[0];
  f.tail<2>() = r.tail<2>() - limit * t;
  if (slope) {
    const Mat2 turn = limit / length * (Mat2::Identity() - t * t.transpose());
    slope->velocity.setZero();
    slope->velocity(0, 0) = 1;
    slope->velocity.bottomLeftCorner<2, 1>() = mu * t;
    slope->velocity.bottomRightCorner<2, 2>() = turn;
    slope->impulse.setZero();
    slope->impulse.bottomLeftCorner<2, 1>() = -mu * t;
    slope->impulse.bottomRightCorner<2, 2>() = Mat2::Identity() - turn;
  }
  return f;
}

/// The proximal problem u = W r + q + alpha (r - centre), W with unit mean diagonals.
class ProximalNewton {
 public:
  ProximalNewton(const DelassusProblem& problem, std::span<const std::int32_t> order)
      : p_(problem),
        order_(order.begin(), order.end()),
        slope_(problem.contacts()),
        place_(problem.contacts()),
        centre_(first_row(problem.contacts())),
        u_(centre_.size()),
        F_(centre_.size()),
        step_(centre_.size()),
        sweep_(problem) {}

  void begin(const Vector& centre, double alpha) {
    centre_ = centre;
    alpha_ = alpha;
    sweep_ = ProximalSweep(p_, std::vector<double>(p_.contacts(), alpha));
  }

  /// |F(r)|, and with `linearise` its slopes.
  double residual(const Vector& r, bool linearise) {
    work_ += check_cost(p_);
    relative_velocity(p_, span_of(r), span_of(u_));
    u_ += alpha_ * (r - centre_);
    for (std::size_t c = 0; c < p_.contacts(); ++c) {
      const Eigen::Index row = first_row(c);
      F_.segment<3>(row) = alart_curnier(r.segment<3>(row), u_.segment<3>(row), p_.diagonal[c].mu,
                                         linearise ? &slope_[c] : nullptr);
    }
    return F_.norm();
  }

  /// Newton's step from r, where `residual` linearised last; false when the matrix is singular.
  bool find_step(const Vector& r) {
    active_.clear();
    std::fill(place_.begin(), place_.end(), -1);
    for (const std::int32_t c : order_) {
      const auto contact = static_cast<std::size_t>(c);
      if (slope_[contact].open) {
        step_.segment<3>(first_row(contact)) = -r.segment<3>(first_row(contact));
      } else {
        place_[contact] = static_cast<std::int32_t>(active_.size());
        active_.push_back(contact);
      }
    }
    if (active_.empty()) return true;
    entries_.clear();
    rhs_.resize(first_row(active_.size()));
    for (std::size_t row = 0; row < active_.size(); ++row) {
      const std::size_t a = active_[row];
      const Linearised& slope = slope_[a];
      Vec3 rhs = -F_.segment<3>(first_row(a));
      const Mat3 own = p_.diagonal[a].W + alpha_ * Mat3::Identity();
      entries_.push_back({place_[a], place_[a], slope.velocity * own + slope.impulse});
      for (auto k = static_cast<std::size_t>(p_.row_begin[a]);
           k < static_cast<std::size_t>(p_.row_begin[a + 1]); ++k) {
        const auto b = static_cast<std::size_t>(p_.column[k]);
        if (place_[b] < 0)
          rhs -= slope.velocity * (p_.block[k] * step_.segment<3>(first_row(b)));
        else
          entries_.push_back({place_[a], place_[b], slope.velocity * p_.block[k]});
      }
      rhs_.segment<3>(first_row(row)) = rhs;
    }
    if (!factors_.factorise(active_.size(), entries_, false)) return false;
    factors_.solve(rhs_);
    if (!rhs_.allFinite()) return false;
    for (std::size_t row = 0; row < active_.size(); ++row)
      step_.segment<3>(first_row(active_[row])) = rhs_.segment<3>(first_row(row));
    return true;
  }

  const Vector& step() const { return step_; }
  /// Multiplications of residuals and sweeps since the last call.
  double take_work() { return std::exchange(work_, 0.0); }
  /// Part of the contacts that the last step took into its matrix.
  double active() const { return static_cast<double>(active_.size()) / static_cast<double>(p_.contacts()); }

  std::int64_t smooth(Vector& r, int sweeps) {
    work_ += sweeps * sweep_cost(p_);
    std::int64_t failed = 0;
    for (int k = 0; k < sweeps; ++k) failed = sweep_(span_of(centre_), span_of(r));
    return failed;
  }

 private:
  const DelassusProblem& p_;
  std::vector<std::int32_t> order_;
  std::vector<Linearised> slope_;
  std::vector<std::int32_t> place_;  ///< row of an active contact, -1 of an open one
  std::vector<std::size_t> active_;  ///< in the order of elimination
  std::vector<detail::BlockEntry> entries_;
  detail::BlockFactorisation factors_;
  Vector centre_, u_, F_, step_, rhs_;
  double alpha_ = 0, work_ = 0;
  ProximalSweep sweep_;
};

/// Goes along the step found from x, as far as the residual falls below nine tenths of `reference`, and
/// smooths; where it falls nowhere on the way, smooths x itself longer. x stays where even that leaves twice
/// the reference. Returns the residual; `failed_contacts`: those that the smoothing could not solve.
double go_on(ProximalNewton& newton, int smoothing, double reference, Vector& x,
             std::int64_t& failed_contacts) {
  Vector trial(x.size());
  const auto residual_behind = [&](int sweeps) {
    failed_contacts = newton.smooth(trial, sweeps);
    return newton.residual(trial, false);
  };
  double part = 1;
  for (int k = 0; k < 4; ++k, part *= 0.25) {
    trial = x + part * newton.step();
    if (const double now = residual_behind(smoothing); now < 0.9 * reference) {
      x = trial;
      return now;
    }
  }
  trial = x;
  const double now = residual_behind(20 * smoothing);
  if (now < 2 * reference) x = trial;
  return now;
}

/// The next proximal parameter: larger behind an outer step that was lost or slow, smaller behind a quick
/// one.
double next_proximal(double alpha, int inner, bool lost) {
  if (lost) return std::min(10 * alpha, 10.0);
  if (inner <= 4) return std::max(0.1 * alpha, 1e-12);
  return inner > 10 ? std::min(3 * alpha, 1.0) : alpha;
}

}  // namespace

struct NewtonIteration::State {
  State(const detail::FactorisedForm& of, const NewtonSettings& how)
      : form(of),
        settings(how),
        newton(of.scaled.problem, of.order),
        x(first_row(of.scaled.problem.contacts())),
        centre(x.size()),
        candidate(3 * of.scaled.problem.contacts()),
        alpha(how.proximal) {}

  void offer(BestAnswer& answer) {
    for (std::size_t k = 0; k < candidate.size(); ++k)
      candidate[k] = x[static_cast<Eigen::Index>(k)] / form.scaled.root[k / 3];
    answer.offer(answer.report().iterations, candidate);
    progress.spend(newton.take_work() + check_cost(form.scaled.problem));
    progress.check(answer.last());
  }
  /// The next problem of the proximal point method.
  void begin_outer() {
    centre = x;
    newton.begin(centre, alpha);
    first = newton.residual(x, true);
    past = {first, 0, 0};
    inner = 0;
  }
  void end_outer(bool lost) {
    if (lost) x = centre;
    alpha = next_proximal(alpha, inner, lost);
    inner = -1;
  }

  const detail::FactorisedForm& form;
  NewtonSettings settings;
  ProximalNewton newton;
  Vector x, centre;
  std::vector<double> candidate;
  double alpha, first = 0;
  std::array<double, 3> past{};
  int inner = -1;  ///< steps on the present proximal problem; -1: it has not begun
  detail::OwnError progress;
};

NewtonIteration::NewtonIteration(const detail::FactorisedForm& form, const NewtonSettings& settings,
                                 std::span<const double> r)
    : state_(std::make_unique<State>(form, settings)) {
  begin_from(r);
}
NewtonIteration::~NewtonIteration() = default;

const detail::OwnError& NewtonIteration::progress() const {
  return state_->progress;
}
detail::OwnError& NewtonIteration::progress() {
  return state_->progress;
}

void NewtonIteration::begin_from(std::span<const double> r) {
  for (std::size_t k = 0; k < r.size(); ++k)
    state_->x[static_cast<Eigen::Index>(k)] = r[k] * state_->form.scaled.root[k / 3];
  state_->inner = -1;
  state_->alpha = state_->settings.proximal;
}

void NewtonIteration::iterate(BestAnswer& answer) {
  State& s = *state_;
  constexpr int most_inner = 30;
  if (s.inner < 0) s.begin_outer();
  const bool last = answer.count();
  ++answer.report().factorisations;
  const bool found = s.newton.find_step(s.x);
  s.progress.spend(s.form.factorisation_cost(s.newton.active()));
  if (!found) {
    s.end_outer(true);
    return;
  }
  const double reference = *std::max_element(s.past.begin(), s.past.end());
  const double now = go_on(s.newton, s.settings.smoothing, reference, s.x, answer.report().failed_contacts);
  const bool failed = !(now < 2 * reference);
  s.past[static_cast<std::size_t>(++s.inner) % s.past.size()] = now;
  s.offer(answer);
  const bool solved = now <= 0.1 * std::min(1.0, s.alpha) * s.first;
  if (last || answer.over()) return;
  if (failed || solved || s.inner >= most_inner)
    s.end_outer(failed || !solved);
  else
    s.newton.residual(s.x, true);
}

bool lawful(const DelassusProblem& problem, std::int64_t& failed_contacts) {
  for (const LocalBlock& own : problem.diagonal) {
    const auto c = static_cast<std::size_t>(&own - problem.diagonal.data());
    failed_contacts += !(own.W(0, 0) > 0) && problem.q[c][0] < 0;
  }
  return failed_contacts == 0;
}

DelassusReport solve_newton(const DelassusProblem& problem, const DelassusGoal& goal,
                            const NewtonSettings& settings, std::span<double> r) {
  BestAnswer answer(problem, goal, r);
  if (answer.over() || problem.contacts() == 0) return answer.hand_back();
  if (!lawful(problem, answer.report().failed_contacts)) return answer.hand_back();
  const detail::FactorisedForm form(problem);
  NewtonIteration newton(form, settings, r);
  while (!answer.over()) newton.iterate(answer);
  answer.report().work = detail::analysis_cost(problem) + newton.progress().work();
  return answer.hand_back();
}

}  // namespace talus
