#include "io/scene/scene_change.hpp"

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/unit/replaced.hpp"

namespace talus::scene_change_test {
namespace {

std::string resolved(const std::vector<std::string>& overrides) {
  return io::resolved_scene(io::parse_scene(R"(box = true
time_step = 1e-3
[material]
density = 2600
friction = 0.35
[sample]
kind = "lattice"
cells = [2, 2, 2]
radius = 0.01
[[wall]]
name = "z+"
drive = "pressure"
pressure = 1e4
[[stage]]
name = "shear"
end = { steps = 4 }
[[stage.load]]
wall = "z+"
drive = "velocity"
velocity = [0, 0, -0.05]
)",
                                            "scene.toml", overrides));
}

TEST(SceneChanges, AreNamedAsSetNamesThem) {
  EXPECT_TRUE(io::scene_changes(resolved({}), resolved({})).empty());
  const auto changes = io::scene_changes(
      resolved({}), resolved({"stage.shear.friction=0.5", "stage.shear.end.steps=8", "seed=2",
                              "stage.shear.load.z+.velocity=[0, 0, -0.1]", "wall.z+.pressure=2e4",
                              "output.every_steps=3", "checkpoint.keep=4"}));
  std::vector<std::string> said;
  for (const io::SceneChange& change : changes)
    said.push_back((change.allowed ? "" : "refused: ") + io::describe(change));
  EXPECT_EQ(said, (std::vector<std::string>{
                      "checkpoint.keep was 2 and is 4", "output.every_steps was not given and is 3",
                      "refused: seed was 1 and is 2", "stage.shear.end.steps was 4 and is 8",
                      "refused: stage.shear.friction was 0.35 and is 0.5",
                      "stage.shear.load.z+.velocity was [0, 0, -0.05] and is [0, 0, -0.1]",
                      "wall.z+.pressure was 10000 and is 20000"}));
}

/// A stage may have the name of what may change in it.
TEST(SceneChanges, AreThoseOfAStageWhateverItIsCalled) {
  for (const std::string name : {"end", "load"}) {
    const auto called = [&](const std::vector<std::string>& overrides) {
      return test::replaced(resolved(overrides), "name = \"shear\"", "name = \"" + name + "\"");
    };
    const auto changes =
        io::scene_changes(called({}), called({"stage.shear.friction=0.5", "stage.shear.end.steps=8"}));
    ASSERT_EQ(changes.size(), 2U);
    EXPECT_TRUE(changes[0].allowed && io::moves_an_end(changes[0])) << changes[0].key;
    EXPECT_FALSE(changes[1].allowed || io::moves_an_end(changes[1])) << changes[1].key;
  }
}

/// Or no run of before could be gone on with after a law has been added.
TEST(SceneChanges, AreNoneWhereAnEarlierVersionDidNotKnowANumberOfTheLawThatIsZero) {
  std::string before;
  std::istringstream lines(resolved({}));
  for (std::string line; std::getline(lines, line);)
    if (!line.starts_with("work_of_adhesion")) before += line + "\n";
  ASSERT_NE(before, resolved({}));
  EXPECT_TRUE(io::scene_changes(before, resolved({})).empty());
  const auto changes = io::scene_changes(before, resolved({"material.work_of_adhesion=0.1"}));
  ASSERT_FALSE(changes.empty());
  EXPECT_FALSE(changes.front().allowed);
  EXPECT_FALSE(io::scene_changes(resolved({"material.work_of_adhesion=0.1"}), before).empty());
}

/// A checkpoint has walls, stages and rules by their places in the scene.
TEST(SceneChanges, OfTheOrderOfWallsOrStagesAreRefused) {
  const auto scene = [](const std::string& walls, const std::string& stages) {
    return io::resolved_scene(io::parse_scene(
        "time_step = 1e-3\n[material]\ndensity = 2600\n[sample]\nkind = \"lattice\"\ncells = [2, 2, 2]\n"
        "radius = 0.01\n" +
            walls + stages,
        "scene.toml", {}));
  };
  const std::string low = "[[wall]]\nname = \"z-\"\n", high = "[[wall]]\nname = \"z+\"\n",
                    press = "[[stage]]\nname = \"press\"\nend = { steps = 4 }\n",
                    shear = "[[stage]]\nname = \"shear\"\nend = { steps = 4 }\n";
  const std::string was = scene(low + high, press + shear);
  const auto said = [&](const std::string& is) {
    std::string all;
    for (const io::SceneChange& change : io::scene_changes(was, is))
      all += (change.allowed ? "" : "refused: ") + io::describe(change);
    return all;
  };
  EXPECT_EQ(said(scene(high + low, press + shear)), "refused: order of wall was z-, z+ and is z+, z-");
  EXPECT_EQ(said(scene(low + high, shear + press)),
            "refused: order of stage was press, shear and is shear, press");
}

}  // namespace
}  // namespace talus::scene_change_test
