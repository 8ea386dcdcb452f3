#pragma once

#include <cmath>
#include <concepts>
#include <vector>

#include "kernels/detection/separation.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus {

/// The space that the sample stands in. It is the only owner of x_i - x_j: detection, measures, output and
/// samples ask it, so that another kind of space is one more type with these functions, and no change
/// elsewhere.
///
///   separation(a, b)   from b to a along the shortest way [m]: the plain difference in a walled domain, that
///                      of the nearest images in a periodic one
///   midpoint(a, b)     halfway along that way [m]
///   wrap(x)            the image of x that is stored [m]; x itself where there are no images
///   lengths(walls)     extent along x, y, z [m]; 0 along an axis that nothing bounds
///   volume(walls)      of the space that the grains may fill [m^3]; 0 where nothing bounds it
///   strain(now, then)  logarithmic strain between two lengths of an axis (28); 0 where either is not bounded
///
/// A domain is chosen when the program is compiled, as `Domain`: inner loops take it as a type, and the
/// walled one is a subtraction there, without a branch. A domain with a state of its own (the edges of a
/// periodic cell) keeps it as members and makes these functions members; the objects are passed wherever a
/// difference is taken (NarrowPhase, Margins, PairView), and are empty today.
template <class D>
concept DomainKind = requires(const D& domain, const Vec3& a, const std::vector<Wall>& walls) {
  { domain.separation(a, a) } -> std::convertible_to<Vec3>;
  { domain.midpoint(a, a) } -> std::convertible_to<Vec3>;
  { domain.wrap(a) } -> std::convertible_to<Vec3>;
  { domain.lengths(walls) } -> std::convertible_to<Vec3>;
  { domain.volume(walls) } -> std::convertible_to<double>;
  { domain.strain(1.0, 1.0) } -> std::convertible_to<double>;
};

/// Bounded by walls alone, or by nothing.
struct WalledDomain : WalledSpace {
  static Vec3 lengths(const std::vector<Wall>& walls) { return box_lengths(walls); }
  static double volume(const std::vector<Wall>& walls) { return box_volume(walls); }
  static double strain(double now, double then) { return then > 0 && now > 0 ? std::log(now / then) : 0; }
};
static_assert(DomainKind<WalledDomain>);

using Domain = WalledDomain;

}  // namespace talus
