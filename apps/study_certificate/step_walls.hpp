#pragma once

/// The walls of a step, made anew from what a scene says of them: where spheres touch those that are no
/// planes, and how prescribed motions move them (docs/theory.md, "Walls"). Of kernels/shapes it takes the
/// numbers of a scene, and the triangles that a mesh was read with; distances and velocities are its own.

#include <span>
#include <vector>

#include "kernels/shapes/walls.hpp"

namespace talus::audit {

/// Where a sphere touches a wall.
struct WallTouch {
  double distance = 0;         ///< [m] of its centre; below 0 in a solid or behind a plane
  Vec3 normal = Vec3::Zero();  ///< unit, from the wall to the centre
  bool beside =
      false;  ///< one of the two of a circle that stand beside the nearest, wherever the centre goes
};

/// A rigid displacement: X -> turn X + shift.
struct Placement {
  Mat3 turn = Mat3::Identity();
  Vec3 shift = Vec3::Zero();  ///< [m]
  Vec3 of(const Vec3& x) const { return turn * x + shift; }
  Vec3 back(const Vec3& x) const { return turn.transpose() * (x - shift); }
};

/// A rigid velocity: that of a point c is origin + omega x c.
struct Twist {
  Vec3 origin = Vec3::Zero(), omega = Vec3::Zero();  ///< [m/s], [rad/s]
  Vec3 at(const Vec3& c) const { return origin + omega.cross(c); }
};

/// A wall of a shape that the audit knows (touch_shapes.hpp), as it is before a step.
class StepWall {
 public:
  /// The step begins at `time` of the run and takes `h` [s]; 0 where nothing moves by itself.
  StepWall(const Wall& wall, double time, double h);

  /// The wall is in this stage.
  bool there() const { return !wall_.absent; }
  bool plane() const { return wall_.surface() == nullptr; }
  /// A prescribed motion moves it, or its surface.
  bool moves() const { return !wall_.motion.empty(); }
  /// From its first place to where it stands `later` [s]; of a wall that a load moves, at the speed that it
  /// has, from where it is.
  Placement placed(double later) const;
  /// Every point nearer than `reach` [m] in which a sphere touches it there.
  std::vector<WallTouch> touches(const Vec3& centre, double reach, const Placement& where) const;
  /// Velocity of its material at a point [m/s] where it touches with this normal: by the rigid motion that
  /// carries it from the middle of the step to that of the next, and that of its surface, along it. It is
  /// that half-way to the next middle, where a body of velocity u takes the point along the surface, which
  /// takes it along the normal. 0 for a wall that a load moves: its velocity is in Motion::walls.
  Vec3 material_velocity(const Vec3& point, const Vec3& normal, const Vec3& u) const;
  /// Of the wall itself at a point, its surface apart; of one that a load moves before the step [m/s].
  Vec3 velocity_at(const Vec3& point) const { return moves() ? rigid_.at(point) : wall_.velocity; }
  /// Angular velocity of its material [rad/s].
  Vec3 spin() const { return moves() ? Vec3(rigid_.omega + along_.omega) : Vec3(Vec3::Zero()); }
  /// The largest speed of its material in a sphere, or more [m/s].
  double speed_near(const Vec3& centre, double radius) const;
  /// How deep a sphere is in it there [m]; 0 where it is outside.
  double overlap(const Vec3& centre, double radius, const Placement& where) const;

 private:
  Wall wall_;
  double time_, h_;
  Twist rigid_, along_;              ///< of the wall, and of its surface against it
  std::vector<Triangle> triangles_;  ///< of a mesh, in its first place
};

/// Of a wall w that is no plane, whether the point in which a sphere touches it belongs to another wall as
/// well, or lies in it, which is nearer to the sphere there: of two plates in a plane a sphere touches that
/// on which it stands, up to the seam. Not where that wall leaves w behind, nor where w itself is nearer: of
/// its circles the sphere touches three points, not the nearest alone.
bool stands_on_another(std::span<const StepWall> walls, std::span<const Placement> placed, std::size_t w,
                       const Vec3& centre, double radius, const WallTouch& touch);

/// The way of a sphere against a wall from the middle of a step to that of the next [m].
struct Way {
  Vec3 before = Vec3::Zero();  ///< with the velocity before the step
  Vec3 loaded = Vec3::Zero();  ///< and with what loads add to it
  double held = 0;             ///< up to this gap cohesion holds, and the way counts for nothing
};

/// By what the law of a step judges a sphere before a wall that is no plane: where it would use up its gap
/// and the wall bends along its way, the touch in which the sphere arrives on `before`, or that at which it
/// is nearest where it does not; at a distance from which the way along that normal leads to where the sphere
/// is by then, and where it does not arrive no nearer by what loads add, as far as the gap goes.
WallTouch on_the_way(const StepWall& wall, const Placement& where, const Vec3& centre, double radius,
                     const Way& way, const WallTouch& touch);

}  // namespace talus::audit
