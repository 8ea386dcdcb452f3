#pragma once

/// Differences of positions, apart from the rest of the domain (kernels/detection/domain.hpp): the lane
/// kernels include this file, and nothing else may come with it (kernels/simd/lanes.hpp).

namespace talus {

/// The integer nearest to a number, or to each lane of a vector; ties go to the even one. |v| < 2^51: adding
/// 1.5 x 2^52 leaves no digit behind the point. The nearest to -v is minus that to v, bit for bit.
template <class T>
[[gnu::always_inline]] inline T nearest_integer(const T& v) {
  constexpr double no_digits = 6755399441055744.0;
  return (v + no_digits) - no_digits;
}

/// Space between walls: positions are coordinates, and two bodies are apart by their difference. Every
/// function is the plain operation, so that a domain of walls costs nothing.
struct WalledSpace {
  /// The difference as it is.
  template <class T>
  [[gnu::always_inline]] static inline void shorten(T&, T&, T&) {}
  template <class T>
  [[gnu::always_inline]] static inline void meet(T&, T&, T&, T&, T&, T&) {}
};

/// Rates of change of the edges of a cell [m/s], as a matrix like that of PeriodicSpace. An image that stands
/// (a, b, c) edges away from a body is faster than the body by this matrix times (a, b, c).
struct EdgeRates {
  double xx = 0, yy = 0, zz = 0;
  double xy = 0, xz = 0, yz = 0;
};

/// Space that repeats itself along the edges (xx, 0, 0), (xy, yy, 0) and (xz, yz, zz) of a cell [m]. Any cell
/// can be turned into this form. Along an axis of walls the diagonal entry and those beside it are 0.
struct PeriodicSpace {
  double xx = 0, yy = 0, zz = 0;
  double xy = 0, xz = 0, yz = 0;
  double per_xx = 0, per_yy = 0, per_zz = 0;  ///< 1/xx, 1/yy, 1/zz [1/m]; 0 along an axis of walls

  /// Puts the difference (x, y, z) of two positions, as numbers or lanes, into the brick |x| <= xx/2,
  /// |y| <= yy/2, |z| <= zz/2 about 0. Of all images it is the shortest where any of them is shorter than
  /// half of the least of xx, yy, zz: that one lies in the brick, which holds one of each.
  template <class T>
  [[gnu::always_inline]] inline void shorten(T& x, T& y, T& z) const {
    const T c = nearest_integer(per_zz * z);
    x = x - xz * c;
    y = y - yz * c;
    z = z - zz * c;
    const T b = nearest_integer(per_yy * y);
    x = x - xy * b;
    y = y - yy * b;
    x = x - xx * nearest_integer(per_xx * x);
  }
  /// Shortens a difference of positions. That of velocities stays: images are as fast as the bodies.
  template <class T>
  [[gnu::always_inline]] inline void meet(T& x, T& y, T& z, T&, T&, T&) const {
    shorten(x, y, z);
  }
};

/// Periodic space whose edges change.
struct FlowingSpace {
  PeriodicSpace cell;
  EdgeRates rates;

  /// Likewise, but changes the difference of velocities, too: images have velocities of their own.
  template <class T>
  [[gnu::always_inline]] inline void meet(T& x, T& y, T& z, T& vx, T& vy, T& vz) const {
    const T c = nearest_integer(cell.per_zz * z);
    x = x - cell.xz * c;
    y = y - cell.yz * c;
    z = z - cell.zz * c;
    const T b = nearest_integer(cell.per_yy * y);
    x = x - cell.xy * b;
    y = y - cell.yy * b;
    const T a = nearest_integer(cell.per_xx * x);
    x = x - cell.xx * a;
    vx = vx - rates.xx * a - rates.xy * b - rates.xz * c;
    vy = vy - rates.yy * b - rates.yz * c;
    vz = vz - rates.zz * c;
  }
};

}  // namespace talus
