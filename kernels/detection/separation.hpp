#pragma once

/// Differences of positions, apart from the rest of the domain (kernels/detection/domain.hpp): the lane
/// kernels include this file, and nothing else may come with it (kernels/simd/lanes.hpp).

namespace talus {

/// The integer nearest to a number, or to each lane of a vector; of two the even one. |v| < 2^51: adding
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
};

/// Space that repeats itself along the edges (xx, 0, 0), (xy, yy, 0) and (xz, yz, zz) of a cell [m]. Any cell
/// is one of these, turned. Along an axis of walls the diagonal entry and those beside it are 0.
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
};

}  // namespace talus
