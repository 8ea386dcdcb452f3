#pragma once

/// Scene files: what a simulation is made of, as a user writes it (docs/scenes.md). One table of keys,
/// io/scene/detail/scene_keys.hpp, is behind reading, checking, writing and the reference page.

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "io/output/sinks.hpp"
#include "io/results/results.hpp"
#include "io/scene/scene_error.hpp"
#include "io/scene/scene_places.hpp"
#include "kernels/law/law_numbers.hpp"
#include "kernels/samples/sample.hpp"
#include "kernels/samples/size_distribution.hpp"
#include "kernels/shapes/body_shapes.hpp"
#include "kernels/shapes/region.hpp"
#include "runtime/step/setup.hpp"

namespace talus::io {

/// Where grains come from. Fields that the kind does not use keep their defaults.
struct SampleSpec {
  enum class Kind {
    deposition,  ///< layer by layer, each grain in the lowest place with three supports, on the floor of
                 ///< `base`
    lattice,     ///< simple cubic, not touching unless spacing is 1; on `base`, of `cells`, or in `region`
    bodies,      ///< read from `file` (io/scene/bodies_file.hpp)
    state,       ///< where an earlier run was: a checkpoint, or a frame of a results.h5, in `file`
    body,        ///< one sphere
    random,      ///< at random places, none in another, of `region` or the periodic cell
  };
  Kind kind = Kind::deposition;
  std::string name;        ///< of a body, whose path is written; for the rest what overrides may call it
  std::int64_t count = 0;  ///< grains; 0 for a lattice given by `cells`, or that fills its region
  std::array<double, 2>
      base{};  ///< [m] the sample stands on [0, base[0]] x [0, base[1]] from `origin`; 0 for other lattices
  Vec3 origin = Vec3::Zero();           ///< [m] lower corner of deposition and lattice
  std::array<std::int64_t, 3> cells{};  ///< grains along x, y, z; 0 for a lattice given otherwise
  std::optional<Region> region;         ///< that a lattice fills, or random grains stand in
  double spacing = 1.05;                ///< lattice: distance of centres over largest diameter, >= 1
  double noise = 0;                     ///< lattice: largest displacement over half the gap of two sites
  BodyShape shape = BodyShape::sphere;  ///< of the grains; their radius is that of Clump
  SizeDistribution radii;
  Vec3 position = Vec3::Zero();          ///< [m] of a body
  Vec3 velocity = Vec3::Zero();          ///< [m/s] of all grains, unless they come from a file
  Vec3 angular_velocity = Vec3::Zero();  ///< [rad/s] likewise
  std::string file;                      ///< absolute path
  std::optional<std::int64_t> frame;     ///< of a results.h5, from 0; none: the last
  std::string material;  ///< of the grains, by name; empty: the first, or those that `file` names

  bool from_file() const { return kind == Kind::bodies || kind == Kind::state; }
  /// Grains of a sample that is made; 0 for a lattice that fills its region.
  std::int64_t grains() const { return count > 0 ? count : cells[0] * cells[1] * cells[2]; }
};

/// What is written during the run and when. Frames come at the first of `every` and `every_steps`, whichever
/// are given.
struct OutputSpec {
  std::string directory;                    ///< out/NAME unless given
  std::optional<double> every;              ///< [s] between frames
  std::optional<std::int64_t> every_steps;  ///< steps between frames
  bool stage_frames = true;         ///< a frame at the ends of each stage, and where the run is stopped
  bool contacts = true;             ///< contacts with forces in the frames
  std::int64_t contacts_every = 1;  ///< of so many frames one has contacts, from the first
  std::int64_t tables_every = 1;    ///< steps from line to line of walls.csv and triaxial.csv
  FrameFormat format = {};          ///< of results.h5
  /// Names of the output sinks to write (io/output/sinks.hpp), besides those that always are.
  std::set<std::string> sinks = default_sinks();
};

/// When a run is written down, so that it can go on from there.
struct CheckpointSpec {
  double every_wall = 600;                    ///< elapsed [s]; 0: never for that
  std::optional<double> every;                ///< simulated [s]
  std::optional<std::int64_t> every_steps;    ///< steps
  int keep = 2;                               ///< of the last ones
  std::optional<std::int64_t> archive_every;  ///< each of so many is kept for good
};

/// A [cell]. Lengths are 0 where there is none.
struct CellSpec {
  Vec3 lengths = Vec3::Zero();  ///< [m]; 0 along an axis that does not repeat
  Vec3 origin = Vec3::Zero();   ///< [m]
  Vec3 shears = Vec3::Zero();   ///< [m] xy, xz, yz
  double inertia = 1;           ///< Setup::cell_inertia
};

/// A [[material]].
struct MaterialSpec {
  std::string name;
  double density = 0;  ///< [kg/m^3]
};

/// A [[pair]]: what is said of the contacts between two materials.
struct PairSpec {
  std::string material, with;                  ///< names
  std::vector<std::optional<double>> numbers;  ///< in order of law_numbers()
  PairSpec() : numbers(law_numbers().size()) {}
};

/// A scene file, read and checked. Values that wait for the grains (see place_walls) are marked as said
/// there.
struct Scene {
  std::string name;
  std::string description;
  double density = 0;                   ///< [kg/m^3] of the only material; 0 where materials have names
  std::vector<MaterialSpec> materials;  ///< by name; empty with [material]
  std::vector<SampleSpec> samples;      ///< none where all grains are inserted
  CellSpec cell;                        ///< of setup.domain
  Stage common;  ///< time_step, gravity and law of the stages that give none themselves; its other fields are
                 ///< not used
  Setup setup;
  OutputSpec output;
  CheckpointSpec checkpoint;
  std::string source_file;
  ScenePlaces places;  ///< in source_file

  /// Begins where an earlier run was: the first sample says so, if any.
  bool from_state() const { return !samples.empty() && samples.front().kind == SampleSpec::Kind::state; }
};

/// What is wrong with the scene, at the line of `key`, or of what the message names; `key` may be empty.
SceneError error_in(const Scene& scene, const std::string& key, const std::string& message);
/// Of `samples[k]`, as the file writes it: [sample], or one of [[sample]].
std::string key_of_sample(const Scene& scene, std::size_t k);

/// Reads a scene. `overrides` are texts "a.b=c" applied in order: the value is read as TOML, or taken as a
/// text if it is none; an element of an array is named by its number or its name (stage.0.time_step,
/// stage[0].time_step, stage.shear.time_step, wall.z+.pressure). Throws SceneError with file, line and key,
/// or with the override.
Scene load_scene(const std::string& path, const std::vector<std::string>& overrides = {});

/// The same from a text; `file` is named in errors, and paths in the scene are relative to its folder.
Scene parse_scene(const std::string& text, const std::string& file,
                  const std::vector<std::string>& overrides = {});

/// Resolves what waits for the grains, then checks the setup:
/// - a wall without position (NaN in `point`) is placed at its side of `sample.base`, else where it touches
/// the outermost grain;
/// - a pushed wall, also in the loads of the stages, without mass (0) gets a tenth of the mass of the grains.
/// - named bodies get their ids.
/// Throws SceneError when there are no grains and none are inserted, walls cross, or the centre of a grain
/// lies behind a wall.
void place_walls(Scene& scene, const Sample& grains);

/// What place_walls gives to a pushed wall without mass [kg].
double automatic_wall_mass(const Sample& grains);

/// The same of a run that goes on, whose grains are not at hand: points of the walls [m], 3 numbers each, and
/// the mass [kg], as they were placed at first, and the ids of the bodies with names. Throws SceneError when
/// the walls or bodies are others.
struct PlacedThen {
  std::vector<double> points;
  double mass = 0;
  std::vector<std::int64_t> named;
};
void place_walls_again(Scene& scene, const PlacedThen& then);

/// The scene as TOML with every default spelled out; parse_scene gives the same scene back.
std::string resolved_scene(const Scene& scene);

/// docs/scenes.md: every key with type, unit, default, range and meaning.
std::string scene_reference();

}  // namespace talus::io
