#pragma once

#include "kernels/shapes/region.hpp"

namespace talus {

/// Volume of a box or cylinder [m^3]; 0 of the others.
double volume_of(const Region& region);

/// Volume of the part of a sphere that lies in a box or cylinder [m^3]; 0 in the others. Exact where the
/// region cuts the sphere with one plane or two parallel ones; where an edge, a corner or the mantle of a
/// cylinder cuts it, by a quadrature whose error is below 1e-5 of the sphere's volume.
double sphere_part(const Region& region, const Vec3& x, double radius);

/// The part, from 0 to 1, of the way from `a` to `b` that lies in the region; of a way of no length 1 or 0.
double way_part(const Region& region, const Vec3& a, const Vec3& b);

/// How a way goes through a disc or plane: 1 along its axis or normal, -1 against it, 0 not at all. A point
/// on the plane lies before it, so that each way that is made of two goes through as often as both.
int passage(const Region& surface, const Vec3& from, const Vec3& to);

}  // namespace talus
