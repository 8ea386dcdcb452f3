#include "io/scene/detail/scene_keys.hpp"

#include <cctype>
#include <cmath>

#include "io/scene/detail/shape_keys.hpp"
#include "io/scene/detail/spelling.hpp"
#include "partition/partitioners.hpp"
#include "runtime/step/methods/method.hpp"

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

/// A wall at a side, waiting for its position (place_walls).
Wall wall_at_side(std::size_t side) {
  Wall wall;
  wall.name = sides()[side];
  wall.normal = normal_of_side(side);
  wall.point = Vec3::Zero();
  wall.point[static_cast<Eigen::Index>(side / 2)] = std::nan("");
  return wall;
}

Section<Scene> top_keys() {
  auto box = bound<bool, Scene>(
      "box", "", any,
      "true: six fixed walls around the sample, named x-, x+, y-, y+, z-, z+; a [[wall]] with one of these "
      "names changes that "
      "wall. The resolved scene lists them instead.",
      [](Scene& scene, bool wanted) {
        for (std::size_t side = 0; wanted && side < sides().size(); ++side)
          scene.setup.walls.push_back(wall_at_side(side));
      },
      [](const Scene&) -> Value { return false; });
  return {
      "",
      "At the top of the file, before the first table.",
      {
          key<Scene>("name", "", any, "Short name: title of pictures, folder of the results.", &Scene::name)
              .or_else("name of the file"),
          key<Scene>("description", "", any, "What the scene is for.", &Scene::description),
          key<Scene>(
              "seed", "", not_negative, "Seed of everything random.",
              [](auto& s) -> auto& { return s.setup.seed; }),
          key<Scene>(
              "rotation", "", any, "false: grains slide and do not turn.",
              [](auto& s) -> auto& { return s.setup.rotation; }),
          key<Scene>(
              "orientation", "", any, "true: integrate and write the orientations of the grains.",
              [](auto& s) -> auto& { return s.setup.orientation; }),
          key<Scene>(
              "allow_unconverged", "", any,
              "true: steps that miss their tolerance are still marked, and the exit code is 0.",
              [](auto& s) -> auto& { return s.setup.allow_unconverged; }),
          key<Scene>(
              "time_step", "s", positive, "Time step of the stages that give none.",
              [](auto& s) -> auto& { return s.common.time_step; })
              .blank_when_zero()
              .or_else("none: each stage gives its own"),
          key<Scene>(
              "gravity", "m/s²", any, "Gravity in the stages that give none.",
              [](auto& s) -> auto& { return s.common.gravity; }),
          std::move(box),
      }};
}

Section<Scene> material_keys() {
  return {
      "[material]",
      "What the grains are made of. Friction and restitution hold in the stages that do not give their own.",
      {
          key<Scene>("density", "kg/m³", positive, "Mass per volume of a grain.", &Scene::density).need(),
          key<Scene>(
              "friction", "", not_negative, "Coulomb friction between grains.",
              [](auto& s) -> auto& { return s.common.law.mu_grains; }),
          key<Scene>(
              "wall_friction", "", not_negative, "Coulomb friction between grains and walls.",
              [](auto& s) -> auto& { return s.common.law.mu_walls; }),
          key<Scene>(
              "restitution", "", zero_to_one, "Newton restitution of the normal velocity.",
              [](auto& s) -> auto& { return s.common.law.restitution; }),
      }};
}

Section<SampleSpec> sample_keys() {
  using Kind = SampleSpec::Kind;
  using Radii = SizeDistribution::Kind;
  const auto made = [](const SampleSpec& s) { return s.kind != Kind::bodies; };
  const auto lattice = [](const SampleSpec& s) { return s.kind == Kind::lattice; };
  const auto one_size = [](const SampleSpec& s) {
    return s.kind != Kind::bodies && s.radii.kind == Radii::constant;
  };
  const auto sizes = [](const SampleSpec& s) {
    return s.kind != Kind::bodies && s.radii.kind != Radii::constant;
  };
  const std::string not_bodies = "kind is not bodies";
  return {
      "[sample]",
      "Where the grains come from. `deposition` lays each grain in the lowest place with three supports, on "
      "z = 0 "
      "between the sides of `base` (Voivret et al. 2007); `lattice` is simple cubic; `bodies` reads a CSV "
      "file with the "
      "columns `id,x,y,z,radius`, then perhaps `vx,vy,vz`, then perhaps `wx,wy,wz` (m, m/s, rad/s).",
      {
          choice<SampleSpec>("kind", {"deposition", "lattice", "bodies"}, "Way of making the sample.",
                             &SampleSpec::kind)
              .need(),
          key<SampleSpec>("count", "", countable, "Number of grains. A lattice may give `cells` instead.",
                          &SampleSpec::count)
              .only(not_bodies, made)
              .blank_when_zero()
              .or_else("none"),
          key<SampleSpec>("base", "m", positive,
                          "The sample stands on [0, base[0]] × [0, base[1]]; goes with `count`.",
                          &SampleSpec::base)
              .only(not_bodies, made)
              .blank_when_zero()
              .or_else("none"),
          key<SampleSpec>("cells", "", countable, "Grains along x, y and z, instead of `count` and `base`.",
                          &SampleSpec::cells)
              .only("kind = lattice", lattice)
              .blank_when_zero()
              .or_else("none"),
          key<SampleSpec>("spacing", "", at_least_one, "Distance of the centres over the largest diameter.",
                          &SampleSpec::spacing)
              .only("kind = lattice", lattice),
          choice<SampleSpec>(
              "radius_distribution", {"constant", "uniform", "uniform_volume"},
              "`uniform`: every radius is as likely; `uniform_volume`: every class of radii holds "
              "the same volume of grains.",
              [](auto& s) -> auto& { return s.radii.kind; })
              .only(not_bodies, made),
          key<SampleSpec>(
              "radius", "m", positive, "Radius of all grains.", [](auto& s) -> auto& { return s.radii.max; })
              .only("radius_distribution = constant", one_size)
              .need(),
          key<SampleSpec>(
              "radius_min", "m", positive, "Smallest radius.", [](auto& s) -> auto& { return s.radii.min; })
              .only("other distributions", sizes)
              .need(),
          key<SampleSpec>(
              "radius_max", "m", positive, "Largest radius.", [](auto& s) -> auto& { return s.radii.max; })
              .only("other distributions", sizes)
              .need(),
          key<SampleSpec>("file", "", any, "CSV file; a relative path begins at the folder of the scene.",
                          &SampleSpec::file)
              .only("kind = bodies", [](const SampleSpec& s) { return s.kind == Kind::bodies; })
              .need(),
      }};
}

std::vector<Key<WallLoad>> load_keys() {
  const auto driven_by = [](WallDrive drive) {
    return [drive](const WallLoad& load) { return load.drive == drive; };
  };
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
      key<WallLoad>("mass", "kg", positive, "Inertia of the wall.", &WallLoad::mass)
          .or_auto(0, "a tenth of the mass of the grains")
          .only("drive = pressure or force", [](const WallLoad& load) { return load.pushed(); }),
  };
}

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
  std::vector<Key<Wall>> all = {std::move(name).need()};
  for (std::vector<Key<Wall>>* some : {&shapes, &keys})
    for (Key<Wall>& one : *some) all.push_back(std::move(one));
  return {"[[wall]]", "A wall. Its load holds from the beginning, until a stage changes it.", std::move(all)};
}

Section<Stage> stage_keys() {
  return {"[[stage]]",
          "Stages run one after the other. What a stage does not give is that of the scene; loads of walls "
          "stay as the stage "
          "before left them.",
          {
              key<Stage>("name", "", any, "Name, unique among the stages.", &Stage::name)
                  .or_else("stage-1, stage-2, ..."),
              key<Stage>("time_step", "s", positive, "Time step h.", &Stage::time_step)
                  .or_else("that of the scene"),
              key<Stage>("gravity", "m/s²", any, "Gravity.", &Stage::gravity).or_else("that of the scene"),
              key<Stage>(
                  "friction", "", not_negative, "Coulomb friction between grains.",
                  [](auto& s) -> auto& { return s.law.mu_grains; })
                  .or_else("that of the material"),
              key<Stage>(
                  "wall_friction", "", not_negative, "Coulomb friction between grains and walls.",
                  [](auto& s) -> auto& { return s.law.mu_walls; })
                  .or_else("that of the material"),
              key<Stage>(
                  "restitution", "", zero_to_one, "Newton restitution of the normal velocity.",
                  [](auto& s) -> auto& { return s.law.restitution; })
                  .or_else("that of the material"),
          }};
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
          choice<StageEnd>("strain_axis", {"x", "y", "z"},
                           "Axis of `strain`; two walls must bound the sample along it.",
                           &StageEnd::strain_axis)
              .only("strain is given", [](const StageEnd& end) { return end.strain.has_value(); }),
          key<StageEnd>(
              "equilibrium", "", positive,
              "Bound on the net force over the applied force of every pushed wall, and on the kinetic energy "
              "over p·V, or over m·g·d under gravity.",
              &StageEnd::equilibrium),
      }};
}

Section<NamedLoad> stage_load_keys() {
  std::vector<Key<NamedLoad>> keys = {
      key<NamedLoad>("wall", "", any, "Name of the wall.", &NamedLoad::first).need()};
  for (auto& load_key : within(load_keys(), &NamedLoad::second)) keys.push_back(std::move(load_key));
  return {"[[stage.load]]",
          "A load that changes when the stage begins; the whole load of the wall is given anew.",
          std::move(keys)};
}

Section<DetectionSettings> detection_keys() {
  return {"[detection]",
          "",
          {
              key<DetectionSettings>("alert", "m", positive,
                                     "A pair with a smaller gap is a contact of the step.",
                                     &DetectionSettings::alert)
                  .or_auto(0, "a tenth of the smallest radius"),
              key<DetectionSettings>("skin", "m", not_negative,
                                     "Margin beyond `alert` within which pairs are remembered as candidates.",
                                     &DetectionSettings::skin)
                  .or_auto(-1, "a fifth of the smallest radius"),
          }};
}

Section<SolverSettings> solver_keys() {
  return {
      "[solver]",
      "When a step counts as solved, and how hard to try.",
      {
          choice<SolverSettings>("method", methods(), &SolverSettings::method),
          key<SolverSettings>("tolerance", "", positive,
                              "Bound on the relative error of the contact law (error_rms).",
                              &SolverSettings::tolerance),
          key<SolverSettings>(
              "balance_tolerance", "", positive,
              "Bound on the estimated error of the forces and on the momentum defect (balance).",
              &SolverSettings::balance_tolerance),
          key<SolverSettings>("max_iterations", "", countable, "Sweeps per step, at most.",
                              &SolverSettings::max_iterations),
          key<SolverSettings>("check_every", "", {.low = 2, .high = countable.high},
                              "Sweeps between the first checks of the error; later checks are rarer.",
                              &SolverSettings::check_every),
          key<SolverSettings>("warm_start", "", any, "Begin from the impulses of the last step.",
                              &SolverSettings::warm_start),
          key<SolverSettings>(
              "overlap_correction", "", {.low = 0, .high = 1},
              "Part of an overlap that a step undoes. 0: overlaps stay, and what the tolerance "
              "leaves adds up over many steps; 0.1 keeps long quasi-static runs tight.",
              &SolverSettings::overlap_correction),
          choice<SolverSettings>(
              "precision", {"mixed", "double"},
              "Numbers of the sweeps. `mixed`: single precision with momentum, on more "
              "than 1000 candidates, until the error is 1e-5; what is judged and written is in "
              "double precision.",
              &SolverSettings::precision),
          choice<SolverSettings>("simd", {"auto", "portable", "avx2", "avx512"},
                                 "Instructions of the sweeps; `auto`: the widest that the processors of all "
                                 "ranks have. All give the same bits; `portable` is slow where the processor "
                                 "has no fused product.",
                                 &SolverSettings::simd),
      }};
}

/// "auto, boxes or fitted": the partitioners that cut boxes.
std::string box_cutters() {
  std::vector<std::string> names;
  for (const auto& partitioner : partitioner_registry())
    if (partitioner.make->takes_boxes) names.emplace_back(partitioner.name);
  const std::string last = names.back();
  names.pop_back();
  return listed(names) + " or " + last;
}

Section<DecompositionSettings> decomposition_keys() {
  using D = DecompositionSettings;
  const auto schwarz = [](const D& d) { return d.coupling == Coupling::schwarz; };
  const auto in_boxes = [](const D& d) { return cuts_boxes(d.partitioner); };
  return {
      "[decomposition]",
      "How the sample is cut into subdomains, and how these act on one another.",
      {
          key<D>("subdomains", "", {.low = 1, .high = most_subdomains},
                 "Number of subdomains, at least one per rank.", &D::subdomains)
              .blank_when_zero()
              .or_else("product of `boxes`, else one per rank"),
          choice<D>("partitioner", partitioner_registry(), &D::partitioner),
          key<D>("boxes", "", countable,
                 "Boxes along x, y and z; their product is `subdomains`, which need not be given.", &D::boxes)
              .blank_when_zero()
              .only("partitioner = " + box_cutters(), in_boxes),
          choice<D>("coupling", couplings(), &D::coupling),
          choice<D>("exchange", {"dcs", "ccs"},
                    "`dcs`: between the subdomains that share a body; `ccs`: through one rank.",
                    &D::exchange),
          choice<D>("mapping", {"block", "cyclic"},
                    "Subdomains on ranks, `block`: consecutive ones share a rank; `cyclic`: dealt out one by "
                    "one. No result depends on it.",
                    &D::mapping),
          key<D>("sweeps_per_exchange", "", countable,
                 "Sweeps between two exchanges (n_GS); `alternating` takes 1 only.", &D::sweeps_per_exchange),
          choice<D>(
              "balance", {"work", "contacts", "time"},
              "What subdomains get equal shares of. `work`: contacts, and what it takes to glue their "
              "interfaces; `time`: measured time of their sweeps, for cores of unequal speed; results then "
              "differ from run to run.",
              &D::balance),
          key<D>("repartition_every", "", countable,
                 "Steps after which space is cut anew, with the next broad phase.", &D::repartition_every),
          key<D>("max_imbalance", "", positive,
                 "Contacts of the fullest subdomain over those of the mean one, less 1, beyond which space "
                 "is cut "
                 "anew at once.",
                 &D::max_imbalance),
          key<D>("overlap", "", any, "Sweep inner chunks while messages fly; false shows what that is worth.",
                 &D::overlap),
          key<D>(
              "damping", "", any,
              "Damp contacts at the interface by multiplicity. Without, Schwarz diverges where bodies stand "
              "in more than two subdomains.",
              &D::damping)
              .only("coupling = schwarz", schwarz),
      }};
}

/// The registry's words as the reference says them.
template <class Item>
std::string sentence_of(const Item& item) {
  std::string sentence(item.sentence);
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  return sentence + ".";
}

/// A key for every output sink that is not always written.
std::vector<Key<OutputSpec>> sink_keys() {
  std::vector<Key<OutputSpec>> keys;
  for (const auto& sink : sink_registry()) {
    if (sink.make->use == SinkUse::always) continue;
    const std::string name(sink.name);
    keys.push_back(bound<bool, OutputSpec>(
        name.c_str(), "", any, sentence_of(sink).c_str(),
        [name](OutputSpec& output, bool wanted) {
          if (wanted)
            output.sinks.insert(name);
          else
            output.sinks.erase(name);
        },
        [name](const OutputSpec& output) -> Value { return output.sinks.contains(name); }));
  }
  return keys;
}

Section<OutputSpec> output_keys() {
  std::vector<Key<OutputSpec>> keys = {
      key<OutputSpec>("directory", "", any, "Where results go, unless the command line says otherwise.",
                      &OutputSpec::directory)
          .or_else("out/NAME"),
      key<OutputSpec>("every", "s", positive, "Time between frames.", &OutputSpec::every),
      key<OutputSpec>("every_steps", "", at_least_one, "Steps between frames.", &OutputSpec::every_steps),
      key<OutputSpec>("stage_frames", "", any,
                      "A frame at the beginning and at the end of each stage, and where the run is stopped.",
                      &OutputSpec::stage_frames),
      key<OutputSpec>("contacts", "", any, "Write the contacts and their forces with each frame.",
                      &OutputSpec::contacts)};
  for (auto& sink_key : sink_keys()) keys.push_back(std::move(sink_key));
  return {"[output]", "What is written, and when. Frames come at the first of `every` and `every_steps`.",
          std::move(keys)};
}

}  // namespace

const SceneKeys& scene_keys() {
  static const SceneKeys keys = {top_keys(),    material_keys(),      sample_keys(),     wall_keys(),
                                 stage_keys(),  stage_end_keys(),     stage_load_keys(), detection_keys(),
                                 solver_keys(), decomposition_keys(), output_keys()};
  return keys;
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
