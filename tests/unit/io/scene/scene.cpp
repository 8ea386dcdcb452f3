#include "io/scene/scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "io/scene/bodies_file.hpp"
#include "io/scene/detail/spelling.hpp"

namespace talus::io::scene_test {
namespace {

const char* const file = "test.toml";

/// A small scene that is right, with one more line at a mark: "#top", "#material", "#sample", "#wall",
/// "#stage" or "#tail".
std::string scene_with(const std::string& mark = "#", const std::string& line = "") {
  std::string text = R"(name = "small"
box = true
#top
[material]
density = 2600
#material
[sample]
kind = "deposition"
count = 10
base = [0.1, 0.1]
radius = 0.01
#sample
[[wall]]
name = "z+"
drive = "pressure"
pressure = 1e4
#wall
[[stage]]
name = "press"
time_step = 1e-3
end = { steps = 5 }
#stage
#tail
)";
  const std::size_t at = text.find(mark + "\n");
  if (!line.empty()) text.replace(at, mark.size(), line);
  return text;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

/// Line (from 1) on which `needle` stands.
int line_of(const std::string& text, const std::string& needle) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(text.find(needle));
  return 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
}

SceneError error_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    parse_scene(text, file, overrides);
  } catch (const SceneError& error) {
    return error;
  }
  ADD_FAILURE() << "accepted:\n" << text;
  return {"", 0, "", ""};
}

/// The text is refused at the line of `needle`, with `key`, and with `said` in the message.
void expect_refused(const std::string& text, const std::string& needle, const std::string& key,
                    const std::string& said) {
  const SceneError error = error_of(text);
  EXPECT_EQ(error.file(), file);
  EXPECT_EQ(error.line(), line_of(text, needle)) << error.what();
  EXPECT_EQ(error.key(), key) << error.what();
  EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
}

/// Refused where one line is added.
void expect_line_refused(const std::string& mark, const std::string& line, const std::string& key,
                         const std::string& said) {
  expect_refused(scene_with(mark, line), line, key, said);
}

// --- What is read
// ------------------------------------------------------------------------------------------------------------

TEST(Scene, BoxMakesSixWallsThatWallTablesChange) {
  const Scene scene = parse_scene(scene_with(), file);
  ASSERT_EQ(scene.setup.walls.size(), 6u);
  EXPECT_EQ(scene.setup.walls[0].name, "x-");
  EXPECT_EQ(scene.setup.walls[0].normal, Vec3(1, 0, 0));
  const Wall& lid = scene.setup.walls[5];
  EXPECT_EQ(lid.name, "z+");
  EXPECT_EQ(lid.normal, Vec3(0, 0, -1));
  EXPECT_EQ(lid.load.drive, WallDrive::pressure);
  EXPECT_EQ(lid.load.pressure, 1e4);
  EXPECT_TRUE(std::isnan(lid.point[2]));
  EXPECT_EQ(scene.output.directory, "out/small");
  EXPECT_EQ(scene.sample.radii.max, 0.01);
  EXPECT_EQ(scene.setup.stages[0].end.steps, 5);
}

TEST(Scene, StagesInheritStepGravityAndLawFromTheScene) {
  std::string text = scene_with("#material", "friction = 0.35\nwall_friction = 0.1\nrestitution = 0.5");
  text = replaced(text, "#top", "gravity = [0, 0, -9.81]\ntime_step = 2e-3");
  text += "[[stage]]\nfriction = 0\ngravity = [0, 0, 0]\nend = { time = 1 }\n";
  const Scene scene = parse_scene(text, file);
  const Stage& first = scene.setup.stages[0];
  const Stage& second = scene.setup.stages[1];
  EXPECT_EQ(first.time_step, 1e-3);
  EXPECT_EQ(first.laws.between(material_of_grains, material_of_grains).friction, 0.35);
  EXPECT_EQ(first.laws.between(material_of_grains, material_of_walls).friction, 0.1);
  EXPECT_EQ(first.laws.between(material_of_grains, material_of_grains).restitution, 0.5);
  EXPECT_EQ(first.gravity, Vec3(0, 0, -9.81));
  EXPECT_EQ(second.name, "stage-2");
  EXPECT_EQ(second.time_step, 2e-3);
  EXPECT_EQ(second.laws.between(material_of_grains, material_of_grains).friction, 0);
  EXPECT_EQ(second.laws.between(material_of_grains, material_of_walls).friction, 0.1);
  EXPECT_EQ(second.gravity, Vec3::Zero());
}

TEST(Scene, StageLoadsAreReadInOrder) {
  const Scene scene =
      parse_scene(scene_with("#tail",
                             "[[stage.load]]\nwall = \"z+\"\ndrive = \"velocity\"\nvelocity = [0, 0, -1]\n"
                             "[[stage.load]]\nwall = \"x+\"\ndrive = \"force\"\nforce = 3\nmass = 2"),
                  file);
  const auto& loads = scene.setup.stages[0].loads;
  ASSERT_EQ(loads.size(), 2u);
  EXPECT_EQ(loads[0].first, "z+");
  EXPECT_EQ(loads[0].second.velocity, Vec3(0, 0, -1));
  EXPECT_EQ(loads[1].second.force, 3);
  EXPECT_EQ(loads[1].second.mass, 2);
}

TEST(Scene, ObliqueWallsAreGivenByNormalAndPoint) {
  const Scene scene = parse_scene(
      scene_with("#wall", "[[wall]]\nname = \"slope\"\nnormal = [3, 0, 4]\npoint = [1, 2, 3]"), file);
  const Wall& slope = scene.setup.walls.back();
  EXPECT_NEAR((slope.normal - Vec3(0.6, 0, 0.8)).norm(), 0, 1e-15);
  EXPECT_EQ(slope.point, Vec3(1, 2, 3));
}

TEST(Scene, AWallAlongAnAxisIsTheSameByNormalAndBySide) {
  const std::string by_side = replaced(scene_with(), "box = true", "");
  const std::string by_normal = replaced(
      by_side, "name = \"z+\"", "name = \"lid\"\nnormal = [0, 0, -0.3]\npoint = [7, 8, 2]\narea = 1");
  const Wall wall = parse_scene(by_normal, file).setup.walls[0];
  EXPECT_EQ(wall.normal, Vec3(0, 0, -1));
  EXPECT_EQ(wall.point, Vec3(0, 0, 2));
}

// --- What is refused, and where
// ------------------------------------------------------------------------------------------------

TEST(SceneErrors, MisspelledKeyIsNamedWithTheOneMeant) {
  expect_line_refused("#material", "frction = 0.3", "material.frction", "did you mean 'friction'?");
  expect_line_refused("#stage", "tme_step = 1", "stage[0].tme_step", "did you mean 'time_step'?");
  expect_line_refused("#top", "sede = 3", "sede", "did you mean 'seed'?");
  expect_refused(replaced(scene_with(), "[material]", "[materiel]"), "[materiel]", "materiel",
                 "did you mean 'material'?");
}

TEST(SceneErrors, KeyInTheWrongTableIsSentToItsOwn) {
  expect_line_refused("#sample", "max_iterations = 3", "sample.max_iterations", "it belongs in [solver]");
}

TEST(SceneErrors, WrongTypeSaysWhatWasExpectedAndFound) {
  expect_line_refused("#material", "friction = \"high\"", "material.friction",
                      "expected real, got the text 'high'");
  expect_line_refused("#top", "gravity = [0, -9.81]", "gravity",
                      "expected list of 3 reals [m/s²], got a list of 2");
  expect_line_refused("#top", "rotation = 1", "rotation", "expected true or false, got the integer 1");
  expect_line_refused("#top", "seed = 1.5", "seed", "expected integer, got the real 1.5");
  expect_line_refused("#tail", "[[solver]]", "solver", "must be a table: write [solver]");
  expect_refused(replaced(scene_with(), "[[stage]]", "[stage]"), "[stage]", "stage", "write [[stage]]");
}

TEST(SceneErrors, NumbersOutOfRangeAreNamedWithTheirLimit) {
  expect_line_refused("#material", "friction = -0.1", "material.friction", "must be >= 0, got -0.1");
  expect_line_refused("#material", "restitution = 1.5", "material.restitution", "must be 0 to 1, got 1.5");
  expect_line_refused("#stage", "wall_friction = nan", "stage[0].wall_friction", "must be finite");
  expect_line_refused("#top", "gravity = [0, 0, -inf]", "gravity", "must be finite");
  expect_line_refused("#top", "time_step = 0", "time_step", "must be > 0, got 0");
  expect_refused(replaced(scene_with(), "radius = 0.01", "radius = -0.01"), "radius = -", "sample.radius",
                 "must be > 0");
  expect_refused(replaced(scene_with(), "density = 2600", "density = 0"), "density", "material.density",
                 "must be > 0");
  expect_refused(replaced(scene_with(), "steps = 5", "steps = 0"), "steps = 0", "stage[0].end.steps",
                 "must be >= 1");
  expect_refused(scene_with("#tail", "[solver]\ntolerance = -1"), "tolerance", "solver.tolerance",
                 "must be > 0");
}

TEST(SceneErrors, MissingKeysAreNamed) {
  expect_refused(replaced(scene_with(), "density = 2600\n", ""), "[material]", "material.density", "missing");
  expect_refused(replaced(scene_with(), "radius = 0.01\n", ""), "[sample]", "sample.radius",
                 "missing; expected: real [m]");
  expect_refused(replaced(scene_with(), "count = 10\n", ""), "[sample]", "sample", "needs count and base");
  expect_refused(replaced(scene_with(), "pressure = 1e4\n", ""), "[[wall]]", "wall[0].pressure", "missing");
  expect_refused(replaced(scene_with(), "time_step = 1e-3\n", ""), "[[stage]]", "stage[0].time_step",
                 "missing");
  expect_refused(replaced(scene_with(), "[material]\ndensity = 2600\n", ""), "name = ", "material",
                 "missing table");
}

TEST(SceneErrors, KeysThatHaveNoMeaningHereAreRefused) {
  expect_line_refused("#wall", "velocity = [0, 0, 1]", "wall[0].velocity", "only with: drive = velocity");
  expect_line_refused("#sample", "radius_min = 0.01", "sample.radius_min", "only with");
  expect_line_refused("#sample", "file = \"a.csv\"", "sample.file", "only with: kind = bodies");
}

TEST(SceneErrors, ChoicesAreChecked) {
  expect_refused(replaced(scene_with(), "\"pressure\"", "\"presure\""), "presure", "wall[0].drive",
                 "did you mean 'pressure'?");
  expect_refused(replaced(scene_with(), "\"deposition\"", "\"heap\""), "heap", "sample.kind",
                 "deposition, lattice, bodies");
}

TEST(SceneErrors, RadiiAreOrdered) {
  const std::string sizes = "radius_distribution = \"uniform\"\nradius_min = 0.02\nradius_max = 0.01";
  expect_refused(replaced(scene_with(), "radius = 0.01", sizes), "radius_min", "sample.radius_min",
                 "0.02 > 0.01");
}

TEST(SceneErrors, MissingFilesAreNamed) {
  std::string text =
      replaced(scene_with(), "count = 10\nbase = [0.1, 0.1]\nradius = 0.01", "file = \"nowhere.csv\"");
  expect_refused(replaced(text, "deposition", "bodies"), "nowhere.csv", "sample.file", "no such file");
  EXPECT_THROW(load_scene("no/such/scene.toml"), SceneError);
}

TEST(SceneErrors, WallsMustNotCrossOverlapOrShareAName) {
  expect_refused(scene_with("#wall", "[[wall]]\nname = \"z+\"  # again"), "\"z+\"  # again", "wall[1].name",
                 "named 'z+' already");
  expect_line_refused("#wall", "[[wall]]\nname = \"lid\"\nside = \"z+\"\nposition = 1", "wall",
                      "'z+' and 'lid' overlap");
  expect_refused(scene_with("#wall", "position = 0.1\n[[wall]]\nname = \"z-\"\nposition = 0.2"), "[[wall]]",
                 "wall", "'z-' and 'z+' cross");
  expect_line_refused("#wall", "[[wall]]\nname = \"lid\"", "wall[1].side", "needs a side or a normal");
  expect_line_refused("#wall", "[[wall]]\nname = \"slope\"\nnormal = [1, 0, 1]", "wall[1].point",
                      "needs a point");
}

TEST(SceneErrors, NamesFitCsvColumnsAndOverrides) {
  expect_refused(replaced(scene_with(), "\"small\"", "\"../small\""), "../small", "name", "letters, digits");
  expect_refused(replaced(scene_with(), "\"press\"", "\"a, b\""), "a, b", "stage[0].name", "letters, digits");
  expect_refused(scene_with("#wall", "[[wall]]\nname = \"\"\nside = \"x-\""), "name = \"\"", "wall[1].name",
                 "letters, digits");
}

TEST(SceneErrors, PressureNeedsAFace) {
  expect_refused(replaced(scene_with(), "box = true", ""), "[[wall]]", "wall", "give its area");
}

TEST(SceneErrors, StagesMustEndAndKnowTheirWalls) {
  expect_refused(replaced(scene_with(), "end = { steps = 5 }\n", ""), "[[stage]]", "stage[0].end", "missing");
  expect_refused(replaced(scene_with(), "steps = 5", ""), "end = ", "stage[0].end", "never ends");
  expect_refused(scene_with("#tail", "[[stage.load]]\nwall = \"z*\""), "wall = \"z*\"",
                 "stage[0].load[0].wall", "no wall is named 'z*'; did you mean 'z-'?");
  expect_refused(scene_with("#tail", "[[stage]]\nname = \"press\"\nend = { steps = 1 }\ntime_step = 1"),
                 "[[stage]]\nname = \"press\"\nend", "stage[1].name", "named 'press' already");
  expect_refused(
      replaced(replaced(scene_with("#wall", "area = 1"), "steps = 5", "strain = 0.1"), "box = true", ""),
      "end =", "stage[0].end.strain", "no two walls");
}

TEST(SceneErrors, EquilibriumNeedsALoad) {
  std::string text = replaced(scene_with(), "drive = \"pressure\"\npressure = 1e4", "");
  expect_refused(replaced(text, "steps = 5", "equilibrium = 1e-3"), "end = ", "stage[0].end.equilibrium",
                 "loads the sample");
}

TEST(SceneErrors, BrokenTomlIsRefusedWithItsLine) {
  const SceneError error = error_of("name = \"a\"\nseed = = 3\n");
  EXPECT_EQ(error.line(), 2);
  EXPECT_EQ(error_of(scene_with("#top", "seed = 1\nseed = 2")).line(), 4);
}

// --- Overrides
// ---------------------------------------------------------------------------------------------------------------

TEST(Overrides, ReachKeysElementsAndListEntries) {
  const Scene scene = parse_scene(scene_with("#top", "gravity = [0, 0, -9.81]"), file,
                                  {"solver.tolerance=1e-5", "stage.0.time_step=1e-4", "stage[0].friction=0.2",
                                   "stage.press.end={time=2}", "wall.z+.pressure=2e4", "gravity[2]=-1.62",
                                   "name=moon", "wall.x+.drive=velocity", "wall.x+.velocity=[-1, 0, 0]"});
  EXPECT_EQ(scene.setup.solver.tolerance, 1e-5);
  EXPECT_EQ(scene.setup.stages[0].time_step, 1e-4);
  EXPECT_EQ(scene.setup.stages[0].laws.between(material_of_grains, material_of_grains).friction, 0.2);
  EXPECT_FALSE(scene.setup.stages[0].end.steps);
  EXPECT_EQ(scene.setup.stages[0].end.time, 2);
  EXPECT_EQ(scene.setup.walls[5].load.pressure, 2e4);
  EXPECT_EQ(scene.setup.walls[1].load.velocity, Vec3(-1, 0, 0));
  EXPECT_EQ(scene.setup.stages[0].gravity, Vec3(0, 0, -1.62));
  EXPECT_EQ(scene.name, "moon");
}

TEST(Overrides, NameAStageWithoutANameAsTheRunDoes) {
  const std::string text = replaced(scene_with("#stage", "[[stage]]\ntime_step = 1e-3\nend = { steps = 1 }"),
                                    "name = \"press\"", "");
  const Scene scene = parse_scene(text, file, {"stage.stage-2.friction=0.5"});
  EXPECT_EQ(scene.setup.stages[1].name, "stage-2");
  EXPECT_EQ(scene.setup.stages[1].laws.between(material_of_grains, material_of_grains).friction, 0.5);
  EXPECT_EQ(scene.setup.stages[0].laws.between(material_of_grains, material_of_grains).friction, 0);
  EXPECT_NE(std::string(error_of(text, {"stage.shear.friction=1"}).what()).find("0 'stage-1', 1 'stage-2'"),
            std::string::npos);
  const std::string wall = replaced(scene_with(), "name = \"z+\"", "side = \"z+\"");
  EXPECT_NE(std::string(error_of(wall, {"wall.stage-1.pressure=1"}).what()).find("no element 'stage-1'"),
            std::string::npos)
      << "walls have no such names";
}

TEST(Decomposition, OfBoxesAloneHasThemAllAndNothingElse) {
  const auto read = [](const std::string& keys) {
    return parse_scene(scene_with("#tail", "[decomposition]\nboxes = [2, 3, 1]\n" + keys), file);
  };
  const Scene alone = read("");
  EXPECT_EQ(alone.setup.decomposition.subdomains, 6);
  EXPECT_EQ(alone.setup.decomposition.partitioner, PartitionKind::boxes);
  EXPECT_EQ(resolved_scene(parse_scene(resolved_scene(alone), file)), resolved_scene(alone));
  EXPECT_EQ(read("partitioner = \"fitted\"").setup.decomposition.partitioner, PartitionKind::fitted);
  EXPECT_EQ(read("subdomains = 6").setup.decomposition.subdomains, 6);
}

TEST(SceneErrors, BoxesAreRefusedWhereTheyWouldBeWithoutEffect) {
  const auto refused = [](const std::string& keys, const std::string& said) {
    expect_refused(scene_with("#tail", "[decomposition]\nboxes = [2, 3, 1]\n" + keys),
                   "boxes =", "decomposition.boxes", said);
  };
  refused("partitioner = \"rcb\"", "only with: partitioner = auto, boxes or fitted");
  refused("partitioner = \"metis\"", "only with");
  refused("subdomains = 5", "2 x 3 x 1 boxes are not 5 subdomains");
  expect_refused(scene_with("#tail", "[decomposition]\nboxes = [65536, 1, 1]"),
                 "boxes =", "decomposition.boxes", "at most 65535");
}

TEST(Scenes, OfMoreGrainsThanCanBeCountedAreRefused) {
  const std::string lattice =
      replaced(replaced(scene_with(), "\"deposition\"", "\"lattice\""), "count = 10\nbase = [0.1, 0.1]",
               "cells = [2097152, 2097152, 4194304]");
  EXPECT_EQ(error_of(lattice).key(), "sample.cells");
}

TEST(Scenes, WithoutANameHaveThatOfTheFileAsOneMayBeWritten) {
  EXPECT_EQ(parse_scene(replaced(scene_with(), "name = \"small\"", ""), "a b/tri axial.v2.toml", {}).name,
            "tri_axial_v2");
}

TEST(Overrides, MistakesNameTheOverride) {
  const auto expect_named = [](const std::string& override, const std::string& said) {
    const SceneError error = error_of(scene_with(), {override});
    EXPECT_EQ(error.file(), "--set " + override);
    EXPECT_EQ(error.line(), 0);
    EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
  };
  expect_named("solver.tolernce=1", "did you mean 'tolerance'?");
  expect_named("slover.tolerance=1", "did you mean 'solver'?");
  expect_named("material.friction=-1", "must be >= 0");
  expect_named("material.friction=rough", "got the text 'rough'");
  expect_named("material.density=1e400", "got 1e400, which is out of the range of numbers");
  expect_named("solver.check_every=1", "must be 2 to");
  expect_named("description=\xff", "not UTF-8");
  expect_named("decomposition.subdomains=4294967297", "65535");
  expect_named("stage.shear.time_step=1", "no element 'shear'; there are: 0 'press'");
  expect_named("stage[7].time_step=1", "no element '7'");
  expect_named("stage.0.end={ steps = 0 }", "must be >= 1");
  expect_named("name.first=1", "under a key that holds a single value");
  expect_named("sample.radius", "KEY=VALUE");
  expect_named("sample..radius=1", "empty");
  expect_named("wall.w+.pressure=1", "no element 'w+'; there are: 0 'z+'");
}

// --- Walls and masses that wait for the grains
// ----------------------------------------------------------------------------------

Sample two_grains() {
  Sample sample;
  sample.x = {Vec3(0.02, 0.02, 0.01), Vec3(0.05, 0.07, 0.03)};
  sample.radius = {0.01, 0.02};
  sample.density = 2600;
  return sample;
}

TEST(PlaceWalls, SidesStandAtTheBaseAndTheLidOnTheHighestGrain) {
  Scene scene =
      parse_scene(scene_with("#stage", "[[stage.load]]\nwall = \"x+\"\ndrive = \"force\"\nforce = 1"), file);
  const Sample grains = two_grains();
  place_walls(scene, grains);
  const auto& walls = scene.setup.walls;
  EXPECT_EQ(walls[0].point, Vec3(0, 0, 0));
  EXPECT_EQ(walls[1].point, Vec3(0.1, 0, 0));
  EXPECT_EQ(walls[3].point, Vec3(0, 0.1, 0));
  EXPECT_EQ(walls[4].point, Vec3(0, 0, 0));
  EXPECT_EQ(walls[5].point, Vec3(0, 0, 0.05));
  const double tenth = 0.1 * (mass(grains, 0) + mass(grains, 1));
  EXPECT_DOUBLE_EQ(walls[5].load.mass, tenth);
  EXPECT_DOUBLE_EQ(scene.setup.stages[0].loads[0].second.mass, tenth);
  EXPECT_EQ(walls[0].load.mass, 0);
}

TEST(PlaceWalls, GivenPositionsAndMassesStay) {
  Scene scene = parse_scene(scene_with("#wall", "position = 0.3\nmass = 7"), file);
  place_walls(scene, two_grains());
  EXPECT_EQ(scene.setup.walls[5].point[2], 0.3);
  EXPECT_EQ(scene.setup.walls[5].load.mass, 7);
}

TEST(PlaceWalls, RefusesGrainsBehindAWallAndNoGrains) {
  Scene scene = parse_scene(scene_with("#wall", "position = 0.02"), file);
  EXPECT_THROW(place_walls(scene, two_grains()), SceneError);
  EXPECT_THROW(place_walls(scene, Sample{}), SceneError);
}

// --- Resolved scene, reference, shipped scenes
// -----------------------------------------------------------------------------------

const char* const shipped[] = {"demo",          "pile-16k",   "compaction-16k", "triaxial-16k",
                               "triaxial-200k", "column-100", "replica-iso12k"};

std::string shipped_path(const std::string& name) {
  return TALUS_SOURCE_DIR "/apps/scenes/" + name + ".toml";
}

TEST(ResolvedScene, ReadsBackToTheSameScene) {
  for (const std::string name : shipped) {
    const Scene scene = load_scene(shipped_path(name));
    const std::string text = resolved_scene(scene);
    const Scene again = parse_scene(text, "elsewhere/scene.resolved.toml");
    EXPECT_EQ(resolved_scene(again), text);
    EXPECT_EQ(again.name, name);
    ASSERT_EQ(again.setup.walls.size(), scene.setup.walls.size());
    for (std::size_t k = 0; k < scene.setup.walls.size(); ++k) {
      EXPECT_EQ(again.setup.walls[k].name, scene.setup.walls[k].name);
      EXPECT_EQ(again.setup.walls[k].normal, scene.setup.walls[k].normal);
      EXPECT_EQ(again.setup.walls[k].velocity, scene.setup.walls[k].velocity);
      EXPECT_EQ(again.setup.walls[k].load.pressure, scene.setup.walls[k].load.pressure);
    }
    ASSERT_EQ(again.setup.stages.size(), scene.setup.stages.size());
    EXPECT_EQ(again.setup.stages.back().time_step, scene.setup.stages.back().time_step);
    EXPECT_EQ(again.setup.stages.back().laws.between(material_of_grains, material_of_grains).friction,
              scene.setup.stages.back().laws.between(material_of_grains, material_of_grains).friction);
    EXPECT_EQ(again.sample.count, scene.sample.count);
    EXPECT_EQ(again.sample.file, scene.sample.file);
  }
}

TEST(ResolvedScene, SpellsOutDefaultsAndKeepsPlacesBitForBit) {
  Scene scene = parse_scene(
      scene_with("#wall", "[[wall]]\nname = \"slope\"\nnormal = [1, 2, 3]\npoint = [-1, -0.1, 0]"), file);
  scene.description = "quotes \" and\nlines \\ and '''";
  place_walls(scene, two_grains());
  scene.setup.walls[5].point[2] = 0.1 + 0.2;
  const std::string text = resolved_scene(scene);
  EXPECT_NE(text.find("balance_tolerance = 0.05"), std::string::npos) << text;
  EXPECT_NE(text.find("alert = \"auto\"  # m"), std::string::npos) << text;
  const Scene again = parse_scene(text, file);
  EXPECT_EQ(again.description, scene.description);
  EXPECT_EQ(again.setup.walls[5].point[2], 0.1 + 0.2);
  EXPECT_EQ(again.setup.walls[5].load.mass, scene.setup.walls[5].load.mass);
  EXPECT_EQ(again.setup.walls[6].normal, scene.setup.walls[6].normal);
  EXPECT_EQ(resolved_scene(again), text);
}

TEST(ShippedScenes, ReplicaIsTheStateOfTheArchive) {
  Scene scene = load_scene(shipped_path("replica-iso12k"));
  const Sample sample = read_bodies(scene.sample.file, scene.density);
  Bodies bodies;
  append(sample, bodies);
  ASSERT_EQ(bodies.size(), 12000u);
  EXPECT_DOUBLE_EQ(bodies.velocity[0].u[0], -4.462695e-03);
  EXPECT_DOUBLE_EQ(bodies.velocity[0].w[2], 1.445077413e-02 * 5.163119e-01);
  place_walls(scene, sample);
  EXPECT_EQ(scene.setup.walls[1].velocity, Vec3(-0.0002423821, 0, 0));
  EXPECT_EQ(scene.setup.detection.alert, 2.00005e-4);
  EXPECT_EQ(scene.setup.detection.skin, 0);
}

TEST(SceneReference, DocsAreUpToDate) {
  std::ifstream in(TALUS_SOURCE_DIR "/docs/scenes.md");
  std::ostringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), scene_reference()) << "write it again: talus scene-reference > docs/scenes.md";
}

TEST(SceneReference, ExampleIsAScene) {
  const std::string text = scene_reference();
  const std::size_t begin = text.find("```toml\n") + 8;
  EXPECT_NO_THROW(parse_scene(text.substr(begin, text.find("```", begin) - begin), file));
}

TEST(Spelling, CountsInsertionsReplacementsAndSwaps) {
  EXPECT_EQ(detail::edit_distance("friction", "friction"), 0u);
  EXPECT_EQ(detail::edit_distance("frction", "friction"), 1u);
  EXPECT_EQ(detail::edit_distance("firction", "friction"), 1u);
  EXPECT_EQ(detail::edit_distance("", "abc"), 3u);
  EXPECT_EQ(detail::nearest("zzzz", {"friction", "density"}), "");
}

}  // namespace
}  // namespace talus::io::scene_test
