#pragma once

#include <string>

#include "io/scene/detail/scene_key.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus::io::detail {

/// Keys of a motion, of a wall or of a group of walls.
Section<MotionPart> wall_motion_keys();
Section<MotionPart> group_motion_keys();

/// Keys of a group of walls, but for its motions.
Section<WallGroup> group_keys();

/// A name that may be left out.
template <class Part>
Key<Part> name_key(const char* name, const char* meaning, std::string Part::*member) {
  return bound<std::string, Part>(
      name, "", any, meaning, [member](Part& part, const std::string& text) { part.*member = text; },
      [member](const Part& part) { return (part.*member).empty() ? Value{} : Value{part.*member}; });
}

/// The stages between which a wall is there, or a motion goes on.
template <class Part>
Key<Part> from_stage_key(const char* meaning) {
  return name_key<Part>("from_stage", meaning, &Part::from_stage).or_else("the first");
}
template <class Part>
Key<Part> until_stage_key(const char* meaning) {
  return name_key<Part>("until_stage", meaning, &Part::until_stage).or_else("none: to the end");
}

/// The point about which a wall or a group tells its torque; not a number: where it says by itself.
template <class Part>
Key<Part> torque_point_key(const char* otherwise) {
  return bound<Vec3, Part>(
             "torque_point", "m", any,
             "Point about which its torque in walls.csv is told; it moves with the wall.",
             [](Part& part, const Vec3& point) { part.torque_point = point; },
             [](const Part& part) {
               return part.torque_point.allFinite() ? Held<Vec3>::out(part.torque_point) : Value{};
             })
      .or_else(otherwise);
}

}  // namespace talus::io::detail
