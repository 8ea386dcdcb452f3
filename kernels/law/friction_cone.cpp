#include "kernels/law/friction_cone.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "kernels/law/detail/quartic.hpp"

namespace talus {
namespace {

using Vec2 = Eigen::Vector2d;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// A solution is accepted when it misses the law by less than this, relative to |q| and to the rounding of W
/// r: far above rounding on blocks whose entries are of one size, far below any tolerance asked of a sweep.
constexpr double accepted = 1e-9;

/// Impulses above this, in units of |q| / W_NN, are an escape along a direction that W does not see, not a
/// solution.
constexpr double escape_limit = 1e12;

/// The sliding equation in units of W_NN and of the largest |q|: r_T(alpha) = (n0 + alpha n1) / det(alpha)
/// with det = alpha^2 + trace alpha + d, and excess(alpha) = |r_T| - mu r_N, times det / max(1, mu).
struct SlidingEquation {
  Vec2 n0, n1;
  Vec2 row;
  double qn, trace, det0;
  double weight_t, weight_n;  ///< 1 / max(1, mu), mu / max(1, mu): no overflow however large mu

  double det(double alpha) const { return (alpha + trace) * alpha + det0; }
  Vec2 numerator(double alpha) const { return n0 + alpha * n1; }
  /// -r_N det
  double normal(double alpha) const { return qn * det(alpha) + row.dot(numerator(alpha)); }
  double excess(double alpha) const { return weight_t * numerator(alpha).norm() + weight_n * normal(alpha); }
  double slope(double alpha) const {
    const Vec2 n = numerator(alpha);
    const double length = n.norm();
    const double of_length = length > 0 ? n.dot(n1) / length : n1.norm();
    return weight_t * of_length + weight_n * (qn * (2 * alpha + trace) + row.dot(n1));
  }
};

/// Largest alpha at which det vanishes, or 0: beyond it r_T(alpha) is regular.
double last_pole(const SlidingEquation& e) {
  if (e.det0 >= 0 && e.trace >= 0) return 0;
  const double discriminant = e.trace * e.trace - 4 * e.det0;
  if (discriminant < 0) return 0;
  return std::max(0.0, 0.5 * (-e.trace + std::sqrt(discriminant)));
}

/// Root of `excess` above `low`, where it is positive, by Newton's method inside a bracket.
std::optional<double> sliding_root(const SlidingEquation& e, double low, double guess) {
  // For large alpha, excess ~ weight_t |n1| alpha + weight_n qn alpha^2 with qn < 0.
  const double far = e.weight_t * e.n1.norm() / (-e.weight_n * e.qn);
  double high = std::max({far + e.trace, 2 * low, std::numeric_limits<double>::min()});
  for (int i = 0; e.excess(high) > 0; ++i) {
    if (i == 200 || !std::isfinite(high)) return std::nullopt;
    low = high;
    high *= 8;
  }
  double alpha =
      guess > low && guess < high ? guess : (low > 0 ? std::sqrt(low) * std::sqrt(high) : 0.5 * high);
  for (int i = 0; i < 200; ++i) {
    const double value = e.excess(alpha);
    if (value == 0) return alpha;
    (value > 0 ? low : high) = alpha;
    double next = alpha - value / e.slope(alpha);
    // Outside the bracket, or not a number: halve the bracket in the exponent, since alpha may be of any
    // size.
    if (!(next > low && next < high)) next = low > 0 ? std::sqrt(low) * std::sqrt(high) : high / 16;
    if (std::abs(next - alpha) <= 4 * epsilon * alpha || high - low <= 4 * epsilon * high) return next;
    alpha = next;
  }
  return std::nullopt;
}

Vec3 sliding_impulse(const SlidingEquation& e, double alpha, double mu) {
  const double det = e.det(alpha);
  const Vec2 rt = e.numerator(alpha) / det;
  const double length = rt.norm();
  const double rn = -e.normal(alpha) / det;
  if (!(rn > 0) || !(length > 0)) return Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  // On the cone exactly; of the two components the one is kept that suffers less from it.
  if (mu > 1) return {length / mu, rt[0], rt[1]};
  return {rn, rt[0] * (mu * rn / length), rt[1] * (mu * rn / length)};
}

/// By how much an impulse inside the cone misses u = 0, relative to q. Not the natural map: with a large mu
/// that multiplies the rounding of u_T.
double stick_residual(const Mat3& W, const Vec3& q, const Vec3& r) {
  if (!(r[0] >= 0) || !(r.norm() < escape_limit)) return std::numeric_limits<double>::infinity();
  return (W * r + q).norm() / (q.norm() + 8 * epsilon / accepted * (W.cwiseAbs() * r.cwiseAbs()).norm());
}

/// By how much an impulse on the cone misses u_N = 0 and u_T opposed to r_T.
double slide_residual(const Mat3& W, const Vec3& q, const Vec3& r) {
  const double rt = r.tail<2>().norm();
  if (!(r[0] >= 0) || !(r.norm() < escape_limit) || !(rt > 0)) return std::numeric_limits<double>::infinity();
  Vec3 miss = W * r + q;
  miss.tail<2>() += r.tail<2>() * (miss.tail<2>().norm() / rt);
  return miss.norm() / (q.norm() + 8 * epsilon / accepted * (W.cwiseAbs() * r.cwiseAbs()).norm());
}

/// Of all roots of the quartic |n(alpha)|^2 weight_t^2 = (weight_n normal(alpha))^2 the sliding impulse of
/// least residual. For blocks on which the bracket fails (not positive semi-definite).
Vec3 best_of_all_roots(const SlidingEquation& e, const Mat3& W, const Vec3& q, double mu) {
  Vec3 best = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  double best_residual = std::numeric_limits<double>::infinity();
  const double t = e.weight_t * e.weight_t, n = e.weight_n * e.weight_n;
  const double c0 = e.qn * e.det0 + e.row.dot(e.n0), c1 = e.qn * e.trace + e.row.dot(e.n1), c2 = e.qn;
  const double a0 = t * e.n0.squaredNorm() - n * c0 * c0, a1 = 2 * t * e.n0.dot(e.n1) - 2 * n * c0 * c1,
               a2 = t * e.n1.squaredNorm() - n * (c1 * c1 + 2 * c0 * c2), a3 = -2 * n * c1 * c2,
               a4 = -n * c2 * c2;
  const auto roots = detail::real_parts_of_roots({a0 / a4, a1 / a4, a2 / a4, a3 / a4});
  if (!roots) return best;
  for (double alpha : *roots) {
    if (alpha <= 0) continue;
    for (int step = 0; step < 5; ++step) {
      const double value = (((a4 * alpha + a3) * alpha + a2) * alpha + a1) * alpha + a0;
      const double slope = ((4 * a4 * alpha + 3 * a3) * alpha + 2 * a2) * alpha + a1;
      const double next = alpha - value / slope;
      if (!(next > 0) || !std::isfinite(next)) break;
      alpha = next;
    }
    const Vec3 r = sliding_impulse(e, alpha, mu);
    const double residual = slide_residual(W, q, r);
    if (residual < best_residual) best = r, best_residual = residual;
  }
  return best;
}

/// Which part of the cone is nearest to z; on the edge, the factors of n and of the tangential part of z.
struct OnCone {
  enum { apex, inside, edge } part;
  double normal = 0, tangential = 0;
};

/// `length` [N s] is that of the tangential part of z.
OnCone project(double z_n, double length, double mu) {
  if (mu * length <= -z_n)
    return {OnCone::apex};  // first: with mu = 0 = length the other one would hold, too
  if (length <= mu * z_n) return {OnCone::inside};
  // A large mu must not overflow in its square.
  const double r_n = mu < 1e8 ? (z_n + mu * length) / (1 + mu * mu) : (z_n / mu + length) / mu;
  return {OnCone::edge, r_n, mu * r_n / length};
}

}  // namespace

Vec3 project_on_cone(const Vec3& z, double mu) {
  const OnCone p = project(z[0], z.tail<2>().norm(), mu);
  if (p.part != OnCone::edge) return p.part == OnCone::apex ? Vec3(Vec3::Zero()) : z;
  return {p.normal, p.tangential * z[1], p.tangential * z[2]};
}

Vec3 project_on_cone(const Vec3& z, const Vec3& n, double mu) {
  const double z_n = n.dot(z);
  if (mu == 0) return std::max(0.0, z_n) * n;
  const Vec3 t = z - z_n * n;
  const OnCone p = project(z_n, t.norm(), mu);
  if (p.part != OnCone::edge) return p.part == OnCone::apex ? Vec3(Vec3::Zero()) : z;
  return p.normal * n + p.tangential * t;
}

Vec3 de_saxce_velocity(const Vec3& u, double mu) {
  Vec3 v = u;
  v[0] += mu * u.tail<2>().norm();
  return v;
}

Vec3 natural_map(const Vec3& r, const Vec3& u, double mu, double rho) {
  return r - project_on_cone(r - rho * de_saxce_velocity(u, mu), mu);
}

LocalBlock local_block(const Mat3& W, double mu) {
  LocalBlock b;
  b.W = W;
  b.mu = mu;
  b.compliance = W.cwiseAbs().maxCoeff();
  if (!(W(0, 0) > 0)) return b;
  const Mat3 scaled = W / W(0, 0);
  b.row = scaled.topRightCorner<1, 2>().transpose();
  b.column = scaled.bottomLeftCorner<2, 1>();
  const Eigen::Matrix2d product = b.column * b.row.transpose();
  b.schur = scaled.bottomRightCorner<2, 2>() - product;
  // What the subtraction leaves of rounding: below it nothing of the Schur complement is known.
  const double noise =
      32 * epsilon *
      std::max(scaled.bottomRightCorner<2, 2>().cwiseAbs().maxCoeff(), product.cwiseAbs().maxCoeff());
  if (b.schur.cwiseAbs().maxCoeff() <= noise) b.schur.setZero();
  b.schur_trace = b.schur.trace();
  b.schur_det = b.schur.determinant();
  if (std::abs(b.schur_det) <= noise * b.schur.cwiseAbs().maxCoeff()) b.schur_det = 0;
  return b;
}

LocalSolution solve_local(const LocalBlock& block, const Vec3& q, const Vec3& guess) {
  if (q[0] >= 0) return {Vec3::Zero(), LocalStatus::open};
  const double wnn = block.W(0, 0);
  const auto failed = [&] {
    if (!(block.compliance > 0)) return LocalSolution{Vec3::Zero(), LocalStatus::failed};
    const Vec3 u = block.W * guess + q;
    const Vec3 r = guess - natural_map(guess, u, block.mu, 1 / block.compliance);
    return LocalSolution{r, LocalStatus::failed};
  };
  if (!(wnn > 0)) return failed();
  if (block.mu == 0) return {Vec3(-q[0] / wnn, 0, 0), LocalStatus::slide};

  // Units: velocities in `speed`, impulses in speed / W_NN.
  const double speed = q.cwiseAbs().maxCoeff();
  const double impulse = speed / wnn;
  const Vec3 qs = q / speed;
  SlidingEquation e;
  e.row = block.row;
  e.qn = qs[0];
  e.trace = block.schur_trace;
  e.det0 = block.schur_det;
  e.n1 = -(qs.tail<2>() - block.column * qs[0]);
  e.n0 = {block.schur(1, 1) * e.n1[0] - block.schur(0, 1) * e.n1[1],
          block.schur(0, 0) * e.n1[1] - block.schur(1, 0) * e.n1[0]};
  const double large = std::max(1.0, block.mu);
  e.weight_t = 1 / large;
  e.weight_n = block.mu / large;

  // Stick: alpha = 0, r_T = n0 / det0. With a singular Schur complement the limit for alpha -> 0+ is n1 /
  // trace, the solution of least |r_T|, if n1 is in its range (then n0 = 0) and infinite if not.
  const Mat3 Ws = block.W / wnn;
  const auto inside = [&](const Vec2& rt) {
    const double rn = -(e.qn + e.row.dot(rt));
    return rt.norm() <= block.mu * rn * (1 + 4 * epsilon) ? std::optional<Vec3>({rn, rt[0], rt[1]})
                                                          : std::nullopt;
  };
  std::optional<Vec3> stick;
  if (e.det0 != 0) {
    stick = inside(e.n0 / e.det0);
  } else {
    const Vec2 rt = e.trace > 0 ? Vec2(e.n1 / e.trace) : Vec2(Vec2::Zero());
    if ((block.schur * rt - e.n1).norm() <= 0.01 * accepted) {
      stick = inside(rt);
      e.n0.setZero();
    }
  }
  if (stick && stick_residual(Ws, qs, *stick) <= accepted) return {impulse * *stick, LocalStatus::stick};

  const double low = last_pole(e);
  Vec3 r = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  if (e.excess(low) >= 0) {
    // alpha of the guess, from u_T = -alpha W_NN r_T; any value outside the bracket means that there is none.
    const Vec2 rt = guess.tail<2>();
    const Vec2 ut = (block.W * guess + q).tail<2>();
    const double hint = rt.squaredNorm() > 0 ? -ut.dot(rt) / (wnn * rt.squaredNorm()) : 0;
    if (const auto alpha = sliding_root(e, low, hint)) r = sliding_impulse(e, *alpha, block.mu);
  }
  if (!(slide_residual(Ws, qs, r) <= accepted)) r = best_of_all_roots(e, Ws, qs, block.mu);
  if (slide_residual(Ws, qs, r) <= accepted) return {impulse * r, LocalStatus::slide};
  return failed();
}

}  // namespace talus
