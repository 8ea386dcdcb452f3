#include "kernels/fields/lucy.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace talus {

namespace {

/// Antiderivative in u of 1 - 6 q^2 + 8 q^3 - 3 q^4 with q^2 = b^2 + u^2.
double antiderivative(double b, double u) {
  const double bb = b * b, uu = u * u, q = std::sqrt(bb + uu);
  const double q2 = u * (bb + uu / 3), q4 = u * (bb * bb + uu * (2 * bb / 3 + uu / 5));
  double q3 = u * q * (q * q / 4 + 3 * bb / 8);
  if (bb > 0) q3 += 3 * bb * bb / 8 * std::asinh(u / b);
  return u - 6 * q2 + 8 * q3 - 3 * q4;
}

}  // namespace

Lucy::Lucy(double width)
    : cutoff_(2 * width), unit_(105 / (16 * std::numbers::pi * cutoff_ * cutoff_ * cutoff_)) {}

double Lucy::at(const Vec3& x) const {
  const double q = x.norm() / cutoff_, rest = 1 - q;
  return q < 1 ? unit_ * (1 + 3 * q) * rest * rest * rest : 0;
}

double Lucy::along(const Vec3& a, const Vec3& b) const {
  const Vec3 way = (b - a) / cutoff_;
  const double length = way.norm();
  if (length == 0) return at(a);
  const Vec3 axis = way / length, from = a / cutoff_;
  const double begin = from.dot(axis);
  const Vec3 across = from - begin * axis;
  const double square = across.squaredNorm();
  if (square >= 1) return 0;
  const double reach = std::sqrt(1 - square), low = std::max(begin, -reach),
               high = std::min(begin + length, reach);
  if (low >= high) return 0;
  const double distance = std::sqrt(square);
  return unit_ * (antiderivative(distance, high) - antiderivative(distance, low)) / length;
}

}  // namespace talus
