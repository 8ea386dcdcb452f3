#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/detection/separation.hpp"
#include "kernels/shapes/surface.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus {

/// The space that the sample stands in: between walls, or a cell that repeats itself along some axes
/// (docs/theory.md, "Periodic cells"). It is the only owner of x_i - x_j: detection, measures, output and
/// samples ask it. Inner loops take the space as a type (with_space): between walls a difference is a
/// subtraction there, without a branch.
///
/// Stored points lie in a brick from `low` on; sheared edges say where the images of that brick stand.
struct Domain {
  PeriodicSpace cell;       ///< all 0 between walls
  Vec3 low = Vec3::Zero();  ///< lower corner of the brick [m]; 0 along an axis of walls
  bool repeats = false;     ///< along any axis
  bool flows = false;       ///< the edges may change
  EdgeRates rates;          ///< of the edges as the step begins [m/s]
  EdgeRates drift_rates;    ///< with the velocities that the step is solved for [m/s]

  /// Edges of the brick [m]; 0 along an axis of walls.
  Vec3 edges() const { return {cell.xx, cell.yy, cell.zz}; }
  /// Geometric mean of its edges [m].
  double mean_edge() const;

  /// work(space): the type that inner loops need.
  template <class Work>
  auto with_space(const Work& work) const {
    return repeats ? work(cell) : work(WalledSpace{});
  }

  /// From b to a along the shortest way [m]: between the nearest of their images.
  Vec3 separation(const Vec3& a, const Vec3& b) const {
    Vec3 d = a - b;
    if (repeats) cell.shorten(d[0], d[1], d[2]);
    return d;
  }

  /// The image of x that is nearest to `to` [m]; x itself, to the bit, between walls.
  Vec3 image_near(const Vec3& to, const Vec3& x) const { return repeats ? Vec3(to + separation(x, to)) : x; }

  /// How many edges along x, y, z the image of b that is nearest to a stands away from b.
  Vec3 edges_between(const Vec3& a, const Vec3& b) const;
  /// Velocity of that image beyond that of b [m/s]: as the step begins, and (image_drift) in its solution.
  Vec3 image_velocity(const Vec3& a, const Vec3& b) const {
    return flows ? times(rates, edges_between(a, b)) : Vec3(Vec3::Zero());
  }
  Vec3 image_drift(const Vec3& a, const Vec3& b) const { return times(drift_rates, edges_between(a, b)); }
  /// Velocity of the flow at x in the step's solution [m/s]: walls stretch with the cell, along their planes.
  Vec3 flow_drift(const Vec3& x) const;
  static Vec3 times(const EdgeRates& r, const Vec3& k) {
    return {r.xx * k[0] + r.xy * k[1] + r.xz * k[2], r.yy * k[1] + r.yz * k[2], r.zz * k[2]};
  }

  /// The middle of that shortest way [m]: the same point for (a, b) and (b, a), bit for bit.
  Vec3 midpoint(const Vec3& a, const Vec3& b) const;

  /// The image of x that lies in the brick, up to rounding [m]; x itself between walls.
  Vec3 wrap(const Vec3& x) const;

  /// How many edges x lies beyond the brick: wrap(x) is x less so many edges.
  Vec3 edges_beyond(const Vec3& x) const;

  /// Extent along x, y, z [m]; 0 along an axis that nothing bounds.
  Vec3 lengths(const std::vector<Wall>& walls) const;

  /// Volume of the space that the grains may fill [m^3]; 0 where nothing bounds it, or where a wall that is
  /// no plane takes room in it.
  double volume(const std::vector<Wall>& walls) const;

  /// Logarithmic strain between two lengths of an axis (28); 0 where either is not bounded.
  static double strain(double now, double then) { return then > 0 && now > 0 ? std::log(now / then) : 0; }

  /// Calls visit(k, image) for each image x + k_x a + k_y b + k_z c of x, a point of the brick, that lies
  /// within `margin` [m] of it along every axis, or within an edge where that is less; k = 0 is one of them.
  template <class Visit>
  void each_image(const Vec3& x, double margin, const Visit& visit) const;

  /// Likewise for each image of any x between the planes of `box` along the axes that repeat; the others do
  /// not count.
  template <class Visit>
  void each_image_in(const Bounds& box, const Vec3& x, const Visit& visit) const;
};

/// A cell with the edges `lengths` [m], 0 along an axis of walls, and the shears (xy, xz, yz) [m] of
/// PeriodicSpace. Throws std::invalid_argument unless lengths are finite and >= 0, one of them is positive,
/// and shears are between axes that repeat.
Domain periodic_domain(const Vec3& lengths, const Vec3& low = Vec3::Zero(),
                       const Vec3& shears = Vec3::Zero());

template <class Visit>
void Domain::each_image(const Vec3& x, double margin, const Visit& visit) const {
  const Vec3 most = edges().cwiseMin(margin);
  each_image_in({low - most, low + edges() + most}, x, visit);
}

template <class Visit>
void Domain::each_image_in(const Bounds& box, const Vec3& x, const Visit& visit) const {
  // Numbers of images along an axis, with the coordinate of the one at hand.
  const auto along = [&](Eigen::Index axis, double at, double edge, const auto& each) {
    if (edge == 0) return each(0.0);
    for (double k = std::ceil((box.low[axis] - at) / edge); k <= (box.high[axis] - at) / edge; ++k) each(k);
  };
  along(2, x[2], cell.zz, [&](double c) {
    const Vec3 up = x + c * Vec3(cell.xz, cell.yz, cell.zz);
    along(1, up[1], cell.yy, [&](double b) {
      const Vec3 beside = up + b * Vec3(cell.xy, cell.yy, 0);
      along(0, beside[0], cell.xx,
            [&](double a) { visit(Vec3(a, b, c), Vec3(beside + a * Vec3(cell.xx, 0, 0))); });
    });
  });
}

}  // namespace talus
