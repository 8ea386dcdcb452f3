/// Lines of what is found wrong with a scene when its file is closed: by its key, or by the names in a
/// message.

#include "io/scene/scene_places.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "io/scene/scene.hpp"

namespace talus::io::scene_places_test {
namespace {

const char* const text = R"(time_step = 1e-4
gravity = [0, 0, -9.81]
[material]
density = 2600
[[sample]]
kind = "lattice"
cells = [2, 2, 2]
radius = 0.01
[[insert]]
radius = 0.01
count = 3
region = { shape = "box", low = [0.05, 0.05, 0], high = [0.09, 0.09, 0.1] }
[[insert]]
name = "sand"
radius = 0.01
count = 3
region = { shape = "box", low = [0.05, 0.05, 0.2], high = [0.09, 0.09, 0.3] }
[[wall]]
name = "z-"
position = 0.1
[[stage]]
name = "fall"
end = { steps = 1 }
[[stage]]
name = "fall-further"
[stage.end]
time = 1
)";

ScenePlaces places(const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "places.toml", overrides).places;
}

TEST(ScenePlaces, AKeyHasItsLineOrThatOfTheTableAroundIt) {
  const ScenePlaces all = places();
  EXPECT_EQ(line_of(all, "material.density", ""), 4);
  EXPECT_EQ(line_of(all, "material.friction", ""), 3) << "which is not there";
  EXPECT_EQ(line_of(all, "sample[0].cells", ""), 7);
  EXPECT_EQ(line_of(all, "insert[1].rate", ""), 13);
  EXPECT_EQ(line_of(all, "stage[1].end.time", ""), 27);
  EXPECT_EQ(line_of(all, "solver.tolerance", "nothing of this"), 0);
}

TEST(ScenePlaces, AMessageHasTheLineOfWhatItNames) {
  const ScenePlaces all = places();
  EXPECT_EQ(line_of(all, "", "stage 'fall': end.steps is odd"), 23) << "the key it goes on with";
  EXPECT_EQ(line_of(all, "", "stage 'fall': it is odd"), 21);
  EXPECT_EQ(line_of(all, "", "stage 'fall-further' is odd"), 24) << "not the stage whose name it begins with";
  EXPECT_EQ(line_of(all, "", "grain 3 lies behind wall 'z-'; move it"), 18);
  EXPECT_EQ(line_of(all, "", "insert 'insert-1' lies in insert 'sand'"), 9) << "of several the first";
  EXPECT_EQ(line_of(all, "wall", "walls 'z-' and 'z+' cross"), 18);
  EXPECT_EQ(line_of(all, "", "samples overlap"), 0) << "these are more than the word";
  EXPECT_EQ(line_of(all, "", "the gravity is odd"), 0) << "a word in a sentence is none of a key";
  EXPECT_EQ(line_of(all, "wall", "grain 3 lies behind wall 'z-'"), 18) << "a name says more than a table";
  EXPECT_EQ(line_of(all, "sample[0].count", "wall 'z-' is in the way"), 5) << "and a key more than a name";
}

TEST(ScenePlaces, WhatAnOverrideHasBroughtInHasNone) {
  EXPECT_EQ(line_of(places({"stage.fall.end.steps=2"}), "", "stage 'fall': end.steps is odd"), 0);
  EXPECT_EQ(line_of(places({"solver.tolerance=1e-4"}), "solver.tolerance", ""), 0);
  EXPECT_EQ(line_of(places({"material.density=2"}), "material.density", ""), 0) << "not that of its table";
  EXPECT_EQ(line_of(places({"material.density=2"}), "", "material.density = 2 is odd"), 0);
}

TEST(ScenePlaces, AGrainBehindAWallIsRefusedAtTheLineOfTheWall) {
  Scene scene = parse_scene(text, "places.toml");
  Sample sample;
  sample.x = {Vec3(0.02, 0.02, 0.05)};
  sample.radius = {0.01};
  sample.density = 2600;
  try {
    place_walls(scene, sample);
    ADD_FAILURE() << "the wall stands above the grain";
  } catch (const SceneError& error) {
    EXPECT_EQ(error.line(), 18) << error.what();
    EXPECT_EQ(error.file(), "places.toml");
  }
}

}  // namespace
}  // namespace talus::io::scene_places_test
