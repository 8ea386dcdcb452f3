#pragma once

#include "kernels/bodies/types.hpp"

namespace talus {

/// Lucy's function, by which a grain is spread over space (Lucy 1977; Weinhart et al. 2012):
///
///   phi(r) = 105 / (16 pi c^3) (1 + 3 r/c) (1 - r/c)^3 for r < c, else 0;   c = 2 width
///
/// It is 1 in all, twice continuously differentiable, and ends at c; the root of the mean of r^2 is the
/// width.
class Lucy {
 public:
  /// width > 0 [m].
  explicit Lucy(double width);
  double cutoff() const { return cutoff_; }  ///< c [m]
  /// phi at a place x away from the grain [1/m^3].
  double at(const Vec3& x) const;
  /// Mean of phi over the straight way from a to b, seen from the place where it is wanted [1/m^3]: the
  /// integral along a branch vector over its length, in closed form.
  double along(const Vec3& a, const Vec3& b) const;

 private:
  double cutoff_, unit_;
};

}  // namespace talus
