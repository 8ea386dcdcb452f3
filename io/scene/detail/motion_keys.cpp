#include "io/scene/detail/motion_keys.hpp"

#include <cmath>
#include <utility>

namespace talus::io::detail {

namespace {

using MotionKind = MotionPart::Kind;

/// A direction of any length.
template <class Access>
Key<MotionPart> direction_key(const char* name, const char* meaning, Access member) {
  return bound<Vec3, MotionPart>(
      name, "", any, meaning,
      [member](MotionPart& part, const Vec3& direction) {
        const double length = direction.norm();
        part.*member = length == 0 || std::abs(length - 1) < 1e-12 ? direction : Vec3(direction / length);
      },
      [member](const MotionPart& part) { return Held<Vec3>::out(part.*member); });
}

/// A key of what turns: of rotations, and of tables, which may have angles. Others hold nothing.
Key<MotionPart> of_turns(Key<MotionPart>&& key) {
  key.get = [held = std::move(key.get)](const MotionPart& part) {
    return part.turns() ? held(part) : Value{};
  };
  return std::move(key)
      .only("kind = rotation, or a table of angles",
            [](const MotionPart& part) {
              return part.kind == MotionKind::rotation || part.kind == MotionKind::table;
            })
      .or_else("required with rotation and angles");
}

std::vector<Key<MotionPart>> motion_keys() {
  const auto of = [](MotionKind kind) {
    return [kind](const MotionPart& part) { return part.kind == kind; };
  };
  return {
      choice<MotionPart>("kind", {"velocity", "rotation", "oscillation", "table"},
                         "`velocity`: along a line, with one velocity; `rotation`: about a line, with one "
                         "rate; `oscillation`: along a line, by amplitude × (sin(2π frequency t + phase) - "
                         "sin phase); `table`: by the rows of a file.",
                         &MotionPart::kind)
          .need(),
      key<MotionPart>("velocity", "m/s", any, "Velocity.", &MotionPart::velocity)
          .only("kind = velocity", of(MotionKind::velocity))
          .need(),
      of_turns(direction_key("axis", "Direction of the axis, of any length; turns are right-handed about it.",
                             &MotionPart::axis)),
      of_turns(key<MotionPart>("point", "m", any, "A point of the axis, where the wall is at first.",
                               &MotionPart::point)),
      key<MotionPart>("rate", "rad/s", any, "Angular velocity about the axis.", &MotionPart::rate)
          .only("kind = rotation", of(MotionKind::rotation))
          .need(),
      direction_key("direction", "Direction, of any length.", &MotionPart::direction)
          .only("kind = oscillation", of(MotionKind::oscillation))
          .need(),
      key<MotionPart>("amplitude", "m", positive, "Half of the way from one end to the other.",
                      &MotionPart::amplitude)
          .only("kind = oscillation", of(MotionKind::oscillation))
          .need(),
      key<MotionPart>("frequency", "1/s", positive, "Periods per second.", &MotionPart::frequency)
          .only("kind = oscillation", of(MotionKind::oscillation))
          .need(),
      key<MotionPart>("phase", "rad", any, "Phase at the beginning.", &MotionPart::phase)
          .only("kind = oscillation", of(MotionKind::oscillation)),
      key<MotionPart>("file", "", any,
                      "CSV file with the columns `t` [s], ascending from 0; then perhaps `x,y,z` [m] or "
                      "`vx,vy,vz` [m/s]; then perhaps `angle` [rad]. Positions and angles count from the "
                      "first row; between rows they, or the velocities, are linear. The run stops where the "
                      "table ends before the motion does. A relative path begins at the folder of the scene.",
                      &MotionPart::file)
          .only("kind = table", of(MotionKind::table))
          .need(),
      key<MotionPart>("surface_only", "", any,
                      "true: the wall stays, and the material in its surface moves, as a belt does; of its "
                      "velocity the part along the surface counts.",
                      &MotionPart::surface_only),
      from_stage_key<MotionPart>("Stage with whose beginning the motion begins, and its time t."),
      until_stage_key<MotionPart>("Stage with whose beginning the motion ends; the wall stays where it is."),
  };
}

}  // namespace

Section<MotionPart> wall_motion_keys() {
  return {
      "[[wall.motion]]",
      "A motion of a wall that nothing can hold up. Several are added: rotations follow one another about "
      "axes that stay in space, then displacements are added. The wall has the drive `fixed`.",
      motion_keys()};
}

Section<MotionPart> group_motion_keys() {
  return {"[[group.motion]]", "The same for all walls of a group.", motion_keys()};
}

Section<WallGroup> group_keys() {
  return {"[[group]]",
          "Walls that move as one: their motion is given here, and walls.csv has a row for their sum.",
          {key<WallGroup>("name", "", any, "Name, unique among walls and groups; walls name it as `group`.",
                          &WallGroup::name)
               .need(),
           torque_point_key<WallGroup>("a point of the axis of the first motion that turns, else that of its "
                                       "first wall")}};
}

}  // namespace talus::io::detail
