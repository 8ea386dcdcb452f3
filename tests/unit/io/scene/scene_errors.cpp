/// What a scene file is refused for: where the error stands, which key it names, and what it says.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "io/scene/scene.hpp"
#include "tests/unit/io/scene/scene_text.hpp"

namespace talus::io::scene_test {
namespace {

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

TEST(SceneErrors, WordsOfOtherProgramsAreAnsweredWithWhatThereIsHere) {
  expect_line_refused("#material", "rolling_friction = 0.1", "material.rolling_friction",
                      "here it is `rolling_resistance`");
  expect_line_refused("#material", "Youngs_Modulus = 1e7", "material.Youngs_Modulus", "grains are rigid");
  expect_line_refused("#top", "mesh = \"a.stl\"", "mesh", "a [[wall]] with shape = \"mesh\"");
  expect_line_refused("#top", "dt = 1e-3", "dt", "here it is `time_step`");
  expect_line_refused("#top", "ranks = 2", "ranks", "mpirun -n 4 talus run SCENE");
}

TEST(SceneErrors, WrongTypeSaysWhatWasExpectedAndFound) {
  expect_line_refused("#material", "friction = \"high\"", "material.friction",
                      "expected real, got the text 'high'");
  expect_line_refused("#top", "gravity = [0, -9.81]", "gravity",
                      "expected list of 3 reals [m/s²], got a list of 2");
  expect_line_refused("#top", "rotation = 1", "rotation", "expected true or false, got the integer 1");
  expect_line_refused("#top", "seed = 1.5", "seed", "expected integer, got the real 1.5");
  expect_line_refused("#top", "seed = 3.0", "seed", "got the real 3.0: write 3");
  expect_line_refused("#top", "seed = 1e3", "seed", "write 1000");
  expect_line_refused("#top", "description = high", "", "texts stand in quotes");
  expect_line_refused("#wall", "group = \"drum\"", "wall[0].group", "there are none");
  expect_line_refused("#tail", "[[solver]]", "solver", "must be a table: write [solver]");
  expect_refused(replaced(scene_with(), "[[stage]]", "[stage]"), "[stage]", "stage", "write [[stage]]");
}

TEST(SceneErrors, NamesLongerThanFilesTakeAreRefused) {
  expect_line_refused("#sample", "name = \"" + std::string(101, 'x') + '"', "sample.name",
                      "has 101 characters");
}

TEST(SceneErrors, NumbersOutOfRangeAreNamedWithTheirLimit) {
  expect_line_refused("#material", "friction = -0.1", "material.friction", "must be 0 to 1e+15, got -0.1");
  expect_line_refused("#material", "friction = 1e200", "material.friction", "must be 0 to 1e+15");
  expect_line_refused("#stage", "wall_friction = 1e200", "stage[0].wall_friction", "must be 0 to 1e+15");
  expect_line_refused("#material", "restitution = 1.5", "material.restitution", "must be 0 to 1, got 1.5");
  expect_line_refused("#stage", "wall_friction = nan", "stage[0].wall_friction", "must be finite");
  expect_line_refused("#top", "gravity = [0, 0, -inf]", "gravity", "must be finite");
  expect_line_refused("#top", "time_step = 0", "time_step", "must be > 0, got 0");
  expect_refused(replaced(scene_with(), "radius = 0.01", "radius = -0.01"), "radius = -", "sample.radius",
                 "must be > 0");
  expect_refused(replaced(scene_with(), "density = 2600", "density = 0"), "density", "material.density",
                 "must be 1e-30 to 1e+30");
  expect_refused(replaced(scene_with(), "density = 2600", "density = 1e-300"), "density", "material.density",
                 "must be 1e-30 to 1e+30, got 1e-300");
  expect_line_refused("#wall", "mass = 1e154", "wall[0].mass", "must be 1e-60 to 1e+60, got 1e+154");
  expect_line_refused("#wall", "area = 1e307", "wall[0].area", "must be within 1e+30 m², got 1e+307");
  expect_line_refused("#wall", "initial_velocity = [0, 0, -1e16]", "wall[0].initial_velocity",
                      "within 1e+15 m/s");
  expect_refused(replaced(scene_with(), "steps = 5", "steps = 0"), "steps = 0", "stage[0].end.steps",
                 "must be >= 1");
  expect_refused(scene_with("#tail", "[solver]\ntolerance = -1"), "tolerance", "solver.tolerance",
                 "must be > 0");
}

// TOML's reader overflowed the stack.
TEST(SceneErrors, KeysOfManyPartsAreRefused) {
  std::string key = "a";
  for (int part = 0; part < 200000; ++part) key += ".a";
  for (const std::string& line : {key + " = 1", "[" + key + "]", "b = {" + key + " = 1}"})
    expect_line_refused("#tail", line, "", "a key of more than 64 parts");
  EXPECT_NE(std::string(error_of(scene_with(), {key + "=1"}).what()).find("parts"), std::string::npos);
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
  expect_refused(replaced(replaced(text, "deposition", "bodies"), "nowhere.csv", "."),
                 "file = ", "sample.file", "is a directory");
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

TEST(SceneErrors, StageWhoseEndNothingBringsAboutIsRefused) {
  const std::string fixed = replaced(scene_with(), "drive = \"pressure\"\npressure = 1e4", "");
  expect_refused(replaced(fixed, "steps = 5", "strain = 0.1"), "end = ", "stage[0].end.strain", "never end");
  EXPECT_NO_THROW(parse_scene(replaced(fixed, "steps = 5", "strain = 0.1, time = 1"), file));
  EXPECT_NO_THROW(parse_scene(replaced(scene_with(), "steps = 5", "strain = 0.1"), file));
  const std::string cell = replaced(replaced(fixed, "box = true", ""), "[[wall]]\nname = \"z+\"\n",
                                    "[cell]\nlengths = [0.2, 0.2, 0.2]\n");
  const std::string still = replaced(replaced(cell, "deposition", "random"), "base = [0.1, 0.1]", "");
  expect_refused(replaced(still, "steps = 5", "shear_strain = 0.1"), "end = ", "stage[0].end.shear_strain",
                 "never end");
  EXPECT_NO_THROW(parse_scene(
      replaced(replaced(still, "steps = 5", "shear_strain = 0.1"), "#stage", "shear_rates = [0, 1, 0]"),
      file));
  // Alike along all axes: the size changes, not the shape.
  for (const auto& [rates, ends] : {std::pair{"[-1, -1, -1]", false}, {"[-1, -1, -0.5]", true}}) {
    const std::string pressed = replaced(replaced(still, "steps = 5", "shear_strain = 0.1"), "#stage",
                                         fmt::format("strain_rates = {}", rates));
    if (ends)
      EXPECT_NO_THROW(parse_scene(pressed, file));
    else
      expect_refused(pressed, "end = ", "stage[0].end.shear_strain", "never end");
  }
}

TEST(SceneErrors, BrokenTomlIsRefusedWithItsLine) {
  const SceneError error = error_of("name = \"a\"\nseed = = 3\n");
  EXPECT_EQ(error.line(), 2);
  EXPECT_EQ(error_of(scene_with("#top", "seed = 1\nseed = 2")).line(), 4);
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

TEST(Overrides, MistakesNameTheOverride) {
  const auto expect_named = [](const std::string& override, const std::string& said) {
    const SceneError error = error_of(scene_with(), {override});
    EXPECT_EQ(error.file(), "--set " + override);
    EXPECT_EQ(error.line(), 0);
    EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
  };
  expect_named("solver.tolernce=1", "did you mean 'tolerance'?");
  expect_named("slover.tolerance=1", "did you mean 'solver'?");
  expect_named("material.friction=-1", "must be 0 to");
  expect_named("material.friction=rough", "got the text 'rough'");
  expect_named("seed=99999999999999999999",
               "got 99999999999999999999, which is out of the range of integers");
  expect_named("seed=-1e999", "got -1e999, which is out of the range of integers");
  expect_named("seed=\"3\"", "got the text '3'");
  expect_named("time_step=.001", "got the text '.001': write 0.001");
  expect_named("time_step=1.", "got the text '1.': write 1.0");
  expect_named("gravity=\"1\"", "got the text '1'");
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

}  // namespace
}  // namespace talus::io::scene_test
