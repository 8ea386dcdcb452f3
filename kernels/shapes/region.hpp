#pragma once

#include <array>

#include "kernels/bodies/types.hpp"
#include "kernels/shapes/surface.hpp"

namespace talus {

/// A part of space that a scene names: where grains are put, taken away, or looked at. Fields that the kind
/// does not use keep their defaults.
struct Region {
  enum class Kind {
    box,       ///< between the corners `low` and `high`
    cylinder,  ///< about the line from `start` to `end`
    disc,      ///< round and flat, about `centre`, at right angles to `axis`
    beyond,    ///< the half space behind a plane: (x - point) . normal > 0
    plane,     ///< the plane itself
  };
  Kind kind = Kind::box;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();   ///< [m] box
  Vec3 start = Vec3::Zero(), end = Vec3::Zero();  ///< [m] cylinder: centres of its ends
  Vec3 centre = Vec3::Zero();                     ///< [m] disc
  Vec3 axis = Vec3::UnitZ();                      ///< disc: of any length
  double radius = 0;                              ///< [m] cylinder, disc
  Vec3 point = Vec3::Zero();                      ///< [m] beyond, plane
  Vec3 normal = Vec3::Zero();                     ///< beyond, plane: of any length

  bool is_round() const { return kind == Kind::cylinder || kind == Kind::disc; }
  bool is_surface() const { return kind == Kind::disc || kind == Kind::plane; }
};

/// "" or what makes no sense: a box without volume, an axis of no length, ...
const char* fault_of(const Region& region);

/// Whether a point [m] lies in the region. A disc and a plane hold none.
bool contains(const Region& region, const Vec3& x);

/// Whether a sphere lies in the region as a whole: in a disc, its centre on it and its great circle within. A
/// plane holds none.
bool holds(const Region& region, const Vec3& x, double radius);

/// Whether there is a place for a sphere of this radius [m].
bool has_room(const Region& region, double radius);

/// The smallest box about a box, cylinder or disc; without limits about the others.
Bounds bounds_of(const Region& region);

/// The centre that three numbers in [0, 1) give to a sphere, which then lies in the region as a whole: evenly
/// distributed over all such places, but that `found` is false for about a fifth of the numbers in a cylinder
/// or disc. Only + - * / and sqrt: the same bits on every machine. The region is bounded and has room for it.
struct Place {
  bool found = false;
  Vec3 x = Vec3::Zero();
};
Place place_in(const Region& region, double radius, const std::array<double, 3>& numbers);

}  // namespace talus
