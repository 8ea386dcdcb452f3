#pragma once

#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/shapes/shape.hpp"

namespace talus {

/// What moves a wall.
enum class WallDrive {
  fixed,     ///< does not move
  velocity,  ///< moves with a prescribed velocity, whatever it costs
  pressure,  ///< free along its normal, with a mass, pushed against the grains by pressure x area
  force,     ///< free along its normal, with a mass, pushed against the grains by a given force
};

/// Load on a wall during a stage. Fields that the drive does not use are 0.
struct WallLoad {
  WallDrive drive = WallDrive::fixed;
  Vec3 velocity = Vec3::Zero();  ///< [m/s], drive velocity
  double pressure = 0;           ///< [Pa] > 0 pushes along +normal, into the grains; drive pressure
  double force = 0;              ///< [N] > 0 pushes along +normal, into the grains; drive force
  double mass = 0;               ///< [kg] > 0; drives pressure and force

  /// Free along the wall's normal.
  bool pushed() const { return drive == WallDrive::pressure || drive == WallDrive::force; }
};

/// A wall: a plane, whose half space normal . (x - point) < 0 is solid, or a surface
/// (kernels/shapes/shape.hpp). A pressed wall has one degree of freedom, its displacement along `normal`;
/// walls never rotate. Only planes move: a surface is fixed, its normal is 0, and its point has no meaning.
struct Wall {
  std::string name;
  Vec3 point = Vec3::Zero();     ///< a point of the plane [m]
  Vec3 normal = Vec3::UnitZ();   ///< unit, into the grains
  double area = 0;               ///< [m^2] the pressure acts on; 0: the current face of the box of walls
  WallLoad load;                 ///< in force now
  Vec3 velocity = Vec3::Zero();  ///< [m/s] now
  Vec3 gain = Vec3::Zero();      ///< what the load adds to it within the step, without contacts [m/s]
  WallShape shape = {};          ///< a plane unless it says otherwise
  Material material = material_of_walls;
  /// Null for a plane.
  const Surface* surface() const { return shape.surface.get(); }
  /// 1/M [1/kg] of a pushed wall; 0 for one that is fixed or driven, whatever mass its load names.
  double inv_mass() const { return load.pushed() && load.mass > 0 ? 1 / load.mass : 0; }
};

/// Area of the face of wall `index` [m^2]: its own `area` if positive, else the product of the distances
/// between the two pairs of opposite walls whose normals are orthogonal to it. Throws std::invalid_argument
/// naming the wall when there are no such pairs.
double face_area(const std::vector<Wall>& walls, std::size_t index);

/// Volume between the three pairs of opposite axis-aligned walls [m^3]; 0 when the walls do not close a box,
/// or when a wall that is no plane takes room in it.
double box_volume(const std::vector<Wall>& walls);

/// Distances between opposite walls along x, y, z [m]; 0 along an axis without a pair of walls.
Vec3 box_lengths(const std::vector<Wall>& walls);

}  // namespace talus
