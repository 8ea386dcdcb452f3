#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/shapes/prescribed_motion.hpp"
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
  Vec3 velocity = Vec3::Zero();  ///< [m/s], drive velocity; of a pushed wall along its face, prescribed
  double pressure = 0;           ///< [Pa] > 0 pushes along +normal, into the grains; drive pressure
  double force = 0;              ///< [N] > 0 pushes along +normal, into the grains; drive force
  double mass = 0;               ///< [kg] > 0; drives pressure and force
  bool weight = false;           ///< gravity acts on that mass

  /// Free along the wall's normal.
  bool pushed() const { return drive == WallDrive::pressure || drive == WallDrive::force; }
};

/// A wall: a plane, whose half space normal . (x - point) < 0 is solid, or a surface
/// (kernels/shapes/shape.hpp), whose normal is 0 and whose point has no meaning. A pressed wall has one
/// degree of freedom, its displacement along `normal`. Any wall may have a prescribed `motion` instead of a
/// load: a plane's point and normal then follow it, a surface stays in its first place and has a pose.
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
  std::vector<MotionPart> motion = {};  ///< prescribed; empty: the load alone moves it
  Pose pose = {};                       ///< of its surface, now
  Vec3 omega = Vec3::Zero();            ///< [rad/s] now, beside `velocity`, which then is that of the
  Vec3 pivot = Vec3::Zero();            ///< point [m] here
  RigidVelocity belt = {};              ///< of the material in its surface, against the surface
  RigidVelocity came = {};  ///< with which, in a time step, a prescribed motion comes as far as it has since
                            ///< the middle of the step before
  Vec3 torque_point = Vec3::Constant(std::nan(""));  ///< in its first place: about which its torque is told
                                                     ///< [m]; not finite: found before the first step
  std::string from_stage = {}, until_stage = {};  ///< there from, and until, the beginning of these; empty:
                                                  ///< always
  bool absent = false;                            ///< in this stage
  std::string group = {};                         ///< that it is one of; empty: none

  /// Its material may move otherwise than with `velocity` alone.
  bool has_drift() const;
  /// How its surface moves at a point c, in space [m/s]. Along a normal its material does the same.
  Vec3 velocity_at(const Vec3& c) const {
    return motion.empty() ? velocity : Vec3(velocity + omega.cross(c - pivot));
  }
  /// How it moved from the middle of the step before to that of this one at a point c [m/s].
  Vec3 came_at(const Vec3& c) const { return motion.empty() ? velocity : came.at(c); }
  /// What its material has beyond `velocity` at a point c of contact with this normal [m/s], of the belt what
  /// lies in the surface. `way`: how far the contact comes until the time of which this is to be (see
  /// half_way); where the material turns it moves otherwise there.
  Vec3 drift_at(const Vec3& c, const Vec3& n, const Vec3& way) const {
    const Vec3 along = belt.at(c) + (omega + belt.omega).cross(way);
    return omega.cross(c - pivot) + along - along.dot(n) * n;
  }
  /// Of a contact at c with a body whose centre of mass has the velocity u, in half of a step h: with the
  /// body along the surface, and with the surface along the normal [m].
  Vec3 half_way(const Vec3& c, const Vec3& n, const Vec3& u, double h) const {
    return h / 2 * (u - n.dot(u - velocity_at(c)) * n);
  }
  /// Null for a plane.
  const Surface* surface() const { return shape.surface.get(); }
  /// 1/M [1/kg] of a pushed wall; 0 for one that is fixed or driven, whatever mass its load names.
  double inv_mass() const { return load.pushed() && load.mass > 0 ? 1 / load.mass : 0; }
};

/// Walls that move as one and tell their force and torque as one.
struct WallGroup {
  std::string name;
  Vec3 torque_point = Vec3::Constant(std::nan(""));  ///< as that of a wall
  std::vector<MotionPart> motion = {};               ///< that its walls have
};

/// Surface::at and Surface::collide of a wall that has a surface, as it stands now, with a sphere in space.
SurfacePoint point_at(const Wall& wall, const Vec3& centre, std::int32_t feature);
void collide(const Wall& wall, const Vec3& centre, double reach, std::vector<SurfacePoint>& points);

/// Parts of a sphere's radius, in (0, 1).
struct SeamThresholds {
  /// A point lies on a wall that is no further away: more than files in single precision round by.
  double on = 1e-6;
  /// Whether a wall comes nearer is asked of a place so far in front of the point: further away another part
  /// of the wall may be near.
  double look = 0.1;
  /// Nearer by less is as near: distances as long as a thousand radii are rounded by as much, of `look`.
  double nearer = 1e-9;
  /// Of two walls that move alike velocities differ by less than this part of them.
  double still = 1e-9;
};

/// Whether the point in which a sphere touches the surface of wall `index` lies on or in another wall, too,
/// that comes nearer to the sphere beside it: of two plates in one plane a sphere beside the seam touches the
/// one that it stands on, and does not stumble over the edge of the other. False where the other wall gives
/// way to the sphere, compared with this one, and for points that are not the nearest of their own wall, as
/// two of the three of a circle.
bool at_seam(std::span<const Wall> walls, std::size_t index, const Vec3& centre, double radius,
             const SurfacePoint& point);

/// Brings a wall to a pose of `first`, the wall in its first place.
void place(const Wall& first, const Pose& pose, Wall& wall);

/// Area of the face of wall `index` [m^2]: its own `area` if positive, else the product of the distances
/// between the two pairs of opposite walls whose normals are orthogonal to it; an axis along which space
/// repeats itself, after `period` [m] > 0, is as good as a pair. Throws std::invalid_argument naming the wall
/// when there are no such pairs.
double face_area(const std::vector<Wall>& walls, std::size_t index, const Vec3& period = Vec3::Zero());

/// Volume between the three pairs of opposite axis-aligned walls [m^3]; 0 when the walls do not close a box,
/// or when a wall that is no plane takes room in it.
double box_volume(const std::vector<Wall>& walls);

/// Distances between opposite walls along x, y, z [m]; 0 along an axis without a pair of walls.
Vec3 box_lengths(const std::vector<Wall>& walls);

}  // namespace talus
