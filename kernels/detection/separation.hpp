#pragma once

/// Differences of positions, apart from the rest of the domain (kernels/detection/domain.hpp): the lane
/// kernels include this file, and nothing else may come with it (kernels/simd/lanes.hpp).

namespace talus {

/// Space between walls: positions are coordinates, and two bodies are apart by their difference. Every
/// function is the plain operation, so that a domain of walls costs nothing.
struct WalledSpace {
  /// a - b, from b to a; for points as vectors of Eigen or of lanes, and for single coordinates.
  template <class T>
  [[gnu::always_inline]] static inline T separation(const T& a, const T& b) {
    return a - b;
  }
  /// Halfway from b to a.
  template <class T>
  [[gnu::always_inline]] static inline T midpoint(const T& a, const T& b) {
    return 0.5 * (a + b);
  }
  /// The position that stands for x: x itself.
  template <class T>
  [[gnu::always_inline]] static inline T wrap(const T& x) {
    return x;
  }
};

}  // namespace talus
