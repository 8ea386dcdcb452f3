#include "kernels/samples/resting_site.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace talus {

namespace {

/// Real roots of k2 r^2 + k1 r + k0, ascending.
struct Roots {
  std::array<double, 2> value{};
  int count = 0;
};

Roots real_roots(double k2, double k1, double k0) {
  if (k2 == 0) return k1 == 0 ? Roots{} : Roots{{-k0 / k1}, 1};
  const double discriminant = k1 * k1 - 4 * k2 * k0;
  if (!(discriminant >= 0)) return {};
  const double half = -0.5 * (k1 + std::copysign(std::sqrt(discriminant), k1));  // no cancellation
  Roots roots{{half / k2, half != 0 ? k0 / half : half / k2}, 2};
  if (roots.value[0] > roots.value[1]) std::swap(roots.value[0], roots.value[1]);
  return roots;
}

/// Keeps the radii where holds(r), whose truth changes only at `roots`; some of these may be spurious.
template <class Condition>
void keep_where(RadiusRanges& ranges, const Roots& roots, const Condition& holds) {
  // What is kept is appended, then what was there is erased: a range can fall into two.
  const std::size_t n = ranges.size();
  for (std::size_t k = 0; k < n; ++k) {
    const RadiusRange range = ranges[k];
    double low = range.low;
    bool open = false;  // the last piece was kept: the next one prolongs it
    for (int m = 0; m <= roots.count; ++m) {
      double high = range.high;
      if (m < roots.count) {
        high = roots.value[static_cast<std::size_t>(m)];
        if (high <= low || high >= range.high) continue;
      }
      const bool hold = holds(0.5 * (low + high));
      if (hold && open)
        ranges.back().high = high;
      else if (hold)
        ranges.push_back({low, high});
      open = hold;
      low = high;
    }
  }
  ranges.erase(ranges.begin(), ranges.begin() + static_cast<std::ptrdiff_t>(n));
}

/// Keeps the radii where k . p(r) + k0 + k1 r >= -slack.
void keep_positive(const SiteCurve& curve, const Vec3& k, double k0, double k1, double slack,
                   RadiusRanges& ranges) {
  const double alpha = k.dot(curve.a) + k0, beta = k.dot(curve.b) + k1, gamma = k.dot(curve.t);
  if (ranges.empty()) return;
  // Nothing to be found where the sign is that of all radii, beyond what rounding may change.
  const double low = ranges.front().low, high = ranges.back().high;
  const double least =
      std::min(beta * low, beta * high) + std::min(gamma * curve.root_low, gamma * curve.root_high);
  const double most =
      std::max(beta * low, beta * high) + std::max(gamma * curve.root_low, gamma * curve.root_high);
  const double doubt = 1e-9 * (std::abs(alpha) + std::abs(beta) * high + std::abs(gamma) * curve.root_high);
  if (alpha + least > doubt) return;
  if (alpha + most < -slack - doubt) {
    ranges.clear();
    return;
  }
  const double g2 = gamma * gamma;
  const Roots roots = real_roots(beta * beta - g2 * curve.q2, 2 * alpha * beta - g2 * curve.q1,
                                 alpha * alpha - g2 * curve.q0);
  keep_where(ranges, roots, [&](double r) { return alpha + beta * r + gamma * curve.root(r) >= -slack; });
}

/// e_z . (p x d) as a function of p.
Vec3 right_angle(const Vec3& d) {
  return {d[1], -d[0], 0};
}

}  // namespace

double SiteCurve::root(double r) const {
  const double square = q(r);
  return square > 0 ? std::sqrt(square) : 0;
}

bool site_curve(double base_radius, const Obstacle& first, const Obstacle& second, int side,
                SiteCurve& curve) {
  const Vec3 w = first.d.cross(second.d);
  const double w2 = w.squaredNorm();
  if (!(w2 > 1e-20 * first.d.squaredNorm() * second.d.squaredNorm())) return false;
  const Vec3 to_first = second.d.cross(w) / w2, to_second = w.cross(first.d) / w2;
  curve.a = first.e0 * to_first + second.e0 * to_second;
  curve.b = first.e1 * to_first + second.e1 * to_second;
  curve.t = w * ((w[2] != 0 ? std::copysign(1.0, w[2]) : side) / std::sqrt(w2));
  curve.q0 = base_radius * base_radius - curve.a.squaredNorm();
  curve.q1 = 2 * (base_radius - curve.a.dot(curve.b));
  curve.q2 = 1 - curve.b.squaredNorm();
  return true;
}

void bound_root(const RadiusRange& range, SiteCurve& curve) {
  const double at_low = curve.q(range.low), at_high = curve.q(range.high);
  double least = std::min(at_low, at_high), most = std::max(at_low, at_high);
  const double slope_low = curve.q1 + 2 * range.low * curve.q2;
  const double slope_high = curve.q1 + 2 * range.high * curve.q2;
  if (slope_low * slope_high < 0) {
    const double turn = curve.q(-0.5 * curve.q1 / curve.q2);
    least = std::min(least, turn);
    most = std::max(most, turn);
  }
  const double doubt =
      1e-9 * (std::abs(curve.q0) + range.high * (std::abs(curve.q1) + range.high * std::abs(curve.q2)));
  curve.q_low = least - doubt;
  curve.q_high = most + doubt;
  curve.root_low = curve.q_low > 0 ? std::sqrt(curve.q_low) : 0;
  curve.root_high = curve.q_high > 0 ? std::sqrt(curve.q_high) : 0;
}

void keep_real(const SiteCurve& curve, RadiusRanges& ranges) {
  if (curve.q_low > 0) return;
  if (curve.q_high < 0) {
    ranges.clear();
    return;
  }
  const Roots roots = real_roots(curve.q2, curve.q1, curve.q0);
  keep_where(ranges, roots, [&](double r) { return curve.q(r) >= 0; });
}

void keep_clear(const SiteCurve& curve, const Obstacle& obstacle, double slack, RadiusRanges& ranges) {
  keep_positive(curve, -obstacle.d, obstacle.e0, obstacle.e1, slack, ranges);
}

void keep_stable(const SiteCurve& curve, const Obstacle& first, const Obstacle& second, double slack,
                 RadiusRanges& ranges) {
  // e_z = lambda_0 n_0 + lambda_1 n_1 + lambda_2 n_2. With n_0 along p, n_i along p - d_i (grain) or -d_i
  // (wall), Cramer's rule gives each lambda as a determinant over det(n_0, n_1, n_2) = p . (d_1 x d_2) >= 0
  // on the upper branch, once 1 and 2 are ordered so that d_1 x d_2 points upwards; all of them are linear in
  // p.
  const double upward = first.d.cross(second.d)[2];
  const Obstacle& one = upward > 0 ? first : second;
  const Obstacle& two = upward > 0 ? second : first;
  if (upward == 0) {
    ranges.clear();  // three supports in a vertical plane carry nothing
    return;
  }
  const Vec3 for_one = right_angle(two.d), for_two = -right_angle(one.d);
  Vec3 for_base = Vec3::Zero();
  if (one.round) for_base -= for_one;
  if (two.round) for_base -= for_two;
  const double scale = std::abs(upward);
  keep_positive(curve, for_one, 0, 0, slack * scale, ranges);
  keep_positive(curve, for_two, 0, 0, slack * scale, ranges);
  keep_positive(curve, for_base, scale, 0, slack * scale, ranges);
}

}  // namespace talus
