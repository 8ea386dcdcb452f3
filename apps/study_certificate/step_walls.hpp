#pragma once

/// The walls of a step, made anew from what a scene says of them: where spheres touch those that are no
/// planes, and how prescribed motions move them (docs/theory.md, "Walls"). Of kernels/shapes it takes the
/// numbers of a scene, and the triangles that a mesh was read with; distances and velocities are its own.

#include <vector>

#include "kernels/shapes/walls.hpp"

namespace talus::audit {

/// Where a sphere touches a wall.
struct WallTouch {
  double distance = 0;         ///< [m] of its centre; below 0 in a solid or behind a plane
  Vec3 normal = Vec3::Zero();  ///< unit, from the wall to the centre
};

/// A rigid displacement: X -> turn X + shift.
struct Placement {
  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();  ///< [m]
  Vec3 of(const Vec3& x) const { return turn * x + shift; }
  Vec3 back(const Vec3& x) const { return turn.transpose() * (x - shift); }
};

/// A wall as it is before a step that begins at `time` of the run [s].
class StepWall {
 public:
  /// Throws std::invalid_argument, naming the wall, where its shape is none that the audit knows.
  StepWall(const Wall& wall, double time);

  /// The wall is in this stage.
  bool there() const { return !wall_.absent; }
  /// A prescribed motion moves it, or its surface.
  bool moves() const { return !wall_.motion.empty(); }
  /// From its first place to where it stands `later` [s]; of a wall that a load moves, at the speed that it
  /// has, from where it is.
  Placement placed(double later) const;
  /// Every point nearer than `reach` [m] in which a sphere touches it there.
  std::vector<WallTouch> touches(const Vec3& centre, double reach, const Placement& where) const;
  /// Velocity of its material at a point [m/s] where it touches with this normal: by the rigid motion that
  /// carries it from the middle of a step of length `h` to that of the next, and that of its surface, along
  /// it. 0 for a wall that a load moves: its velocity is in Motion::walls.
  Vec3 material_velocity(const Vec3& point, const Vec3& normal, double h) const;
  /// The largest speed of its material near a sphere, or more [m/s].
  double speed_near(const Vec3& centre, double radius, double h) const;
  /// How deep a sphere is in it there [m]; 0 where it is outside.
  double overlap(const Vec3& centre, double radius, const Placement& where) const;

 private:
  Wall wall_;
  double time_;
  std::vector<Triangle> triangles_;  ///< of a mesh, in its first place
};

}  // namespace talus::audit
