#include "io/scene/scene_change.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace talus::scene_change_test
