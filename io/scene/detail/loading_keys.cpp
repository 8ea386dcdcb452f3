#include "io/scene/detail/loading_keys.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/scene/detail/material_keys.hpp"
#include "io/scene/detail/motion_keys.hpp"
#include "io/scene/detail/shape_keys.hpp"

namespace talus::io::detail {

namespace {

/// Unit normal, into the grains, of the wall at a side of a box.
Vec3 normal_of_side(std::size_t side) {
  const auto axis = static_cast<Eigen::Index>(side / 2);
  return side % 2 == 0 ? Vec3(Vec3::Unit(axis)) : Vec3(-Vec3::Unit(axis));
}

std::size_t side_index(const std::string& text) {
  return static_cast<std::size_t>(std::find(sides().begin(), sides().end(), text) - sides().begin());
}

std::vector<Key<WallLoad>> load_keys() {
  const auto driven_by = [](WallDrive drive) {
    return [drive](const WallLoad& load) { return load.drive == drive; };
  };
  const auto pushed = [](const WallLoad& load) { return load.pushed(); };
  return {
      choice<WallLoad>("drive", {"fixed", "velocity", "pressure", "force"},
                       "What moves the wall. Walls driven by pressure or force are free along their normal.",
                       &WallLoad::drive),
      key<WallLoad>("velocity", "m/s", any, "Velocity, whatever it costs.", &WallLoad::velocity)
          .only("drive = velocity", driven_by(WallDrive::velocity))
          .need(),
      key<WallLoad>("pressure", "Pa", not_negative,
                    "Pushes into the grains with pressure × area of the wall's face.", &WallLoad::pressure)
          .only("drive = pressure", driven_by(WallDrive::pressure))
          .need(),
      key<WallLoad>("force", "N", not_negative, "Pushes into the grains.", &WallLoad::force)
          .only("drive = force", driven_by(WallDrive::force))
          .need(),
      key<WallLoad>("mass", "kg", sound_mass, "Inertia of the wall.", &WallLoad::mass)
          .or_auto(0, "a tenth of the mass of the grains")
          .only("drive = pressure or force", pushed),
      key<WallLoad>("weight", "", any,
                    "true: gravity acts on that mass, along the normal; a lid is a wall with force = 0, its "
                    "mass and weight = true.",
                    &WallLoad::weight)
          .only("drive = pressure or force", pushed),
      bound<Vec3, WallLoad>(
          "tangential_velocity", "m/s", any,
          "Velocity along its face, whatever it costs: shear under a load.",
          [](WallLoad& load, const Vec3& velocity) { load.velocity = velocity; },
          [](const WallLoad& load) { return Held<Vec3>::out(load.velocity); })
          .only("drive = pressure or force", pushed),
  };
}

}  // namespace

Section<Wall> wall_keys() {
  std::vector<Key<Wall>> shapes = shape_keys();
  auto name = bound<std::string, Wall>(
      "name", "", any, "Name, unique among the walls.",
      [](Wall& wall, const std::string& text) {
        wall.name = text;
        if (const std::size_t at = side_index(text); at < sides().size()) wall.normal = normal_of_side(at);
      },
      [](const Wall& wall) -> Value { return wall.name; });
  auto side = bound<std::string, Wall>(
      "side", "", any, "Side of the sample at which the wall stands, facing it.",
      [](Wall& wall, const std::string& text) { wall.normal = normal_of_side(side_index(text)); },
      [](const Wall& wall) -> Value {
        const int axis = axis_of(wall);
        if (axis < 0) return {};
        return sides()[static_cast<std::size_t>(2 * axis + (wall.normal[axis] > 0 ? 0 : 1))];
      });
  side.choices = sides();
  auto normal = bound<Vec3, Wall>(
      "normal", "", any, "Direction into the grains, of any length, instead of `side`.",
      [](Wall& wall, const Vec3& direction) {
        const double length = direction.norm();
        wall.normal = length == 0 || std::abs(length - 1) < 1e-12 ? direction : Vec3(direction / length);
      },
      [](const Wall& wall) { return axis_of(wall) < 0 ? Held<Vec3>::out(wall.normal) : Value{}; });
  auto position = bound<double, Wall>(
      "position", "m", any, "Coordinate of the wall's face along its axis.",
      [](Wall& wall, double coordinate) {
        if (const int axis = axis_of(wall); axis >= 0) wall.point[axis] = coordinate;
      },
      [](const Wall& wall) {
        const int axis = axis_of(wall);
        return axis < 0 ? Value{} : Value{wall.point[axis]};
      });
  auto point = bound<Vec3, Wall>(
      "point", "m", any, "A point of the wall's face, instead of `position`; an oblique wall needs it.",
      [](Wall& wall, const Vec3& place) { wall.point = place; },
      [](const Wall& wall) { return axis_of(wall) < 0 ? Held<Vec3>::out(wall.point) : Value{}; });
  std::vector<Key<Wall>> keys = {
      std::move(side).or_else("the name, if it is one of these; else `normal` is given"),
      std::move(normal).or_else("from `side`"),
      std::move(position)
          .or_auto(std::nan(""), "at the side of `sample.base`, else at the outermost grain")
          .only("side or a normal along an axis", [](const Wall& wall) { return axis_of(wall) >= 0; }),
      std::move(point).or_else("from `position`"),
      key<Wall>("area", "m²", positive, "Area that a pressure acts on.", &Wall::area)
          .or_auto(0, "the wall's face in the box of walls, as it is at each step")};
  for (auto& load_key : within(load_keys(), &Wall::load)) keys.push_back(std::move(load_key));
  keys.push_back(key<Wall>("initial_velocity", "m/s", any, "Velocity at the beginning, along the normal.",
                           &Wall::velocity)
                     .only("drive = pressure or force", [](const Wall& wall) { return wall.load.pushed(); }));
  keep_for_planes(keys);
  // Numbers of materials are known to the whole scene only, which reads and writes this key.
  auto material = bound<std::string, Wall>(
      "material", "", any, "Name of its material.", [](Wall&, const std::string&) {},
      [](const Wall&) -> Value { return {}; });
  std::vector<Key<Wall>> all = {
      std::move(name).need(),
      std::move(material).or_else("the first"),
      name_key<Wall>("group", "Name of the [[group]] that it moves and reports with.", &Wall::group)
          .or_else("none"),
      from_stage_key<Wall>("Stage with whose beginning the wall appears. A `motion` of it has a from_stage "
                           "of its own, and moves the "
                           "wall before it appears, too."),
      until_stage_key<Wall>("Stage with whose beginning the wall vanishes, as the gate of a dam."),
      torque_point_key<Wall>(
          "a point of the axis of its first motion that turns, else that of its group, else "
          "the point of a plane, and the middle of the box around a surface")};
  for (std::vector<Key<Wall>>* some : {&shapes, &keys})
    for (Key<Wall>& one : *some) all.push_back(std::move(one));
  return {"[[wall]]", "A wall. Its load holds from the beginning, until a stage changes it.", std::move(all)};
}

Wall wall_at_side(std::size_t side) {
  Wall wall;
  wall.name = sides()[side];
  wall.normal = normal_of_side(side);
  wall.point = Vec3::Zero();
  wall.point[static_cast<Eigen::Index>(side / 2)] = std::nan("");
  return wall;
}

Section<Stage> stage_keys() {
  const auto chooses = [](const Stage& stage) { return stage.chooses_time_step; };
  std::vector<Key<Stage>> keys = {
      key<Stage>("name", "", any, "Name, unique among the stages.", &Stage::name)
          .or_else("stage-1, stage-2, ..."),
      time_step_key<Stage>(
          "Time step h; \"auto\": each step's is chosen by what moves and how near it is "
          "(docs/theory.md, \"Choice of the time step\").",
          [](auto& stage) -> auto& { return stage; })
          .or_else("that of the scene"),
      key<Stage>("time_step_max", "s", positive, "Longest time step.", &Stage::time_step_max)
          .or_auto(0,
                   "that of the scene, else the time in which a grain falls by 2.5 % of the smallest radius")
          .only("time_step = \"auto\"", chooses),
      key<Stage>("time_step_min", "s", positive, "Shortest time step.", &Stage::time_step_min)
          .or_auto(0, "that of the scene, else the longest over 1024")
          .only("time_step = \"auto\"", chooses),
      key<Stage>("gravity", "m/s²", any, "Gravity.", &Stage::gravity).or_else("that of the scene"),
      key<Stage>("strain_rates", "1/s", any,
                 "Of the periodic cell: dv_x/dx, dv_y/dy, dv_z/dz, negative where it shrinks.",
                 &Stage::strain_rates)
          .blank_when_zero()
          .or_else("`[0.0, 0.0, 0.0]`"),
      key<Stage>("shear_rates", "1/s", any, "Of the periodic cell: dv_x/dy, dv_x/dz, dv_y/dz.",
                 &Stage::shear_rates)
          .blank_when_zero()
          .or_else("`[0.0, 0.0, 0.0]`")};
  for (Key<Stage>& law_key : stage_law_keys()) keys.push_back(std::move(law_key));
  return {"[[stage]]",
          "Stages run one after the other. What a stage does not give is that of the scene; loads of walls "
          "stay as the stage before left them. Where materials have names, what a stage says of contacts "
          "holds for all pairs.",
          std::move(keys)};
}

Section<StageEnd> stage_end_keys() {
  return {
      "[stage.end]",
      "When the stage ends: at the first of the conditions given. At least one is given.",
      {
          key<StageEnd>("steps", "", at_least_one, "Number of steps.", &StageEnd::steps),
          key<StageEnd>("time", "s", positive, "Time of the stage.", &StageEnd::time),
          key<StageEnd>(
              "strain", "", positive,
              "Magnitude of the logarithmic strain along `strain_axis` since the beginning of the stage.",
              &StageEnd::strain),
          choice<StageEnd>(
              "strain_axis", {"x", "y", "z"},
              "Axis of `strain`; two walls bound the sample along it, or a cell that is strained does.",
              &StageEnd::strain_axis)
              .only("strain is given", [](const StageEnd& end) { return end.strain.has_value(); }),
          key<StageEnd>("shear_strain", "", positive,
                        "Path of the shear of the periodic cell since the beginning of the stage, with every "
                        "deviatoric rate "
                        "that it has, those that a stress makes among them: of simple shear at the rate g "
                        "for a time t, g t. (Where the flow begins from rest, within the first step, edges "
                        "lean by half a step's shear less.)",
                        &StageEnd::shear_strain),
          key<StageEnd>(
              "equilibrium", "", positive,
              "Bound on `equilibrium` of steps.csv: net forces over the load, and kinetic energy over load × "
              "mean diameter.",
              &StageEnd::equilibrium),
          key<StageEnd>("equilibrium_hold", "", not_negative,
                        "Time for which that bound must have held, in times that a grain takes to fall by "
                        "its diameter d: "
                        "√(2 d m/load), under gravity alone √(2 d/g).",
                        &StageEnd::equilibrium_hold)
              .only("equilibrium is given", [](const StageEnd& end) { return end.equilibrium.has_value(); }),
          key<StageEnd>("stress_ratio", "", positive,
                        "q/p of the contacts in a step, q = √(3/2 s : s) of the stress deviator s: the stage "
                        "ends where it is reached.",
                        &StageEnd::stress_ratio),
          key<StageEnd>("inertial_below", "", positive,
                        "The inertial number of the periodic cell (cell.csv) is at most this: it has come "
                        "to rest.",
                        &StageEnd::inertial_below),
          key<StageEnd>("inertial_above", "", positive,
                        "The inertial number is at least this: it flows, as under a shear stress that grows.",
                        &StageEnd::inertial_above),
          key<StageEnd>("inertial_hold", "", not_negative,
                        "Time for which such a bound must have held, in inertial times d √(ρ/p).",
                        &StageEnd::inertial_hold)
              .only("inertial_below or inertial_above is given",
                    [](const StageEnd& end) { return end.inertial_below || end.inertial_above; }),
          key<StageEnd>(
              "steady", "", positive,
              "Steady state: bound on the drift of the means of q/p and of the solid fraction, from "
              "one window to the next.",
              &StageEnd::steady),
          key<StageEnd>("steady_strain", "", positive,
                        "Length of a window: path of the shear of the periodic cell.",
                        &StageEnd::steady_strain)
              .only("steady is given, and no steady_time",
                    [](const StageEnd& end) { return end.steady && !end.steady_time; }),
          key<StageEnd>("steady_time", "s", positive, "Length of a window, instead: time.",
                        &StageEnd::steady_time)
              .only("steady is given", [](const StageEnd& end) { return end.steady.has_value(); }),
      }};
}

Section<StageLoad> stage_load_keys() {
  std::vector<Key<StageLoad>> keys = {
      key<StageLoad>("wall", "", any, "Name of the wall.", &StageLoad::wall).need()};
  for (auto& load_key : within(load_keys(), &StageLoad::load)) keys.push_back(std::move(load_key));
  return {"[[stage.load]]",
          "A load that changes when the stage begins; the whole load of the wall is given anew.",
          std::move(keys)};
}

const std::vector<std::string>& sides() {
  static const std::vector<std::string> names = {"x-", "x+", "y-", "y+", "z-", "z+"};
  return names;
}

int axis_of(const Wall& wall) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(wall.normal[axis]) == 1) return axis;
  return -1;
}

}  // namespace talus::io::detail
