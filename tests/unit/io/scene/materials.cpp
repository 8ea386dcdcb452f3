/// [[material]] and [[pair]] of scene files.

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "io/scene/scene.hpp"
#include "tests/unit/replaced.hpp"

namespace talus::io {
namespace {

using test::replaced;

const std::string file = "materials.toml";

std::string scene_with(const std::string& materials, const std::string& stage = "") {
  return "time_step = 1e-3\n" + materials + R"(
[sample]
kind = "lattice"
cells = [2, 2, 2]
radius = 0.01
#sample
[[wall]]
name = "floor"
side = "z-"
#wall
[[stage]]
end = { steps = 5 }
)" + stage;
}

const std::string two = R"(
[[material]]
name = "glass"
density = 2500
[[material]]
name = "steel"
density = 7800
[[pair]]
material = "glass"
friction = 0.5
restitution = 0.9
[[pair]]
material = "steel"
friction = 0.2
restitution = 0.7
)";

std::string message_of(const std::string& text) {
  try {
    parse_scene(text, file);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

TEST(SceneMaterials, PairThatIsNotGivenHasTheSmallerNumbersOfBoth) {
  const Scene scene = parse_scene(scene_with(two), file);
  const PairTable& laws = scene.setup.stages[0].laws;
  EXPECT_EQ(laws.between(0, 0), (PairLaw{0.5, 0.9}));
  EXPECT_EQ(laws.between(1, 1), (PairLaw{0.2, 0.7}));
  EXPECT_EQ(laws.between(0, 1), (PairLaw{0.2, 0.7}));
  EXPECT_EQ(scene.materials[1].density, 7800);
}

TEST(SceneMaterials, PairThatIsGivenHasWhatItSaysAndTheRestByTheRule) {
  const Scene scene = parse_scene(
      scene_with(two + "[[pair]]\nmaterial = \"steel\"\nwith = \"glass\"\nfriction = 0.35\n"), file);
  EXPECT_EQ(scene.setup.stages[0].laws.between(0, 1), (PairLaw{0.35, 0.7}));
}

TEST(SceneMaterials, WallsAndSamplesNameTheirsAndElseHaveTheFirst) {
  std::string text = replaced(scene_with(two), "#wall", "material = \"steel\"\n[[wall]]\nname = \"z+\"");
  text = replaced(text, "#sample", "material = \"steel\"");
  const Scene scene = parse_scene(text, file);
  EXPECT_EQ(scene.setup.walls[0].material, 1);
  EXPECT_EQ(scene.setup.walls[1].material, 0);
  EXPECT_EQ(scene.samples.front().material, "steel");
}

TEST(SceneMaterials, StageChangesAllPairsOrOneOfThem) {
  const Scene scene = parse_scene(
      scene_with(two,
                 "friction = 0\n[[stage.pair]]\nmaterial = \"glass\"\nwith = \"steel\"\nfriction = 0.1\n"),
      file);
  const PairTable& laws = scene.setup.stages[0].laws;
  EXPECT_EQ(laws.between(0, 0), (PairLaw{0, 0.9}));
  EXPECT_EQ(laws.between(0, 1), (PairLaw{0.1, 0.7}));
  EXPECT_EQ(scene.common.laws.between(0, 0).friction, 0.5);
}

TEST(SceneMaterials, ResolvedSceneGivesTheSameSceneBack) {
  std::string text =
      replaced(scene_with(two, "restitution = 0.1\n[[stage.pair]]\nmaterial = \"glass\"\nfriction = 0.3\n"),
               "#wall", "material = \"steel\"");
  const Scene scene = parse_scene(text, file);
  const std::string resolved = resolved_scene(scene);
  const Scene again = parse_scene(resolved, file);
  EXPECT_EQ(resolved_scene(again), resolved);
  EXPECT_EQ(again.setup.stages[0].laws, scene.setup.stages[0].laws);
  EXPECT_EQ(again.common.laws, scene.common.laws);
  EXPECT_EQ(again.setup.walls[0].material, 1);
}

TEST(SceneMaterials, MistakesAreNamedWithTheirLineAndWhatWasMeant) {
  const std::pair<std::string, std::string> wrong[] = {
      {scene_with(two + "[[pair]]\nmaterial = \"glas\"\n"), "no material is named 'glas'"},
      {scene_with(two + "[[pair]]\nmaterial = \"steel\"\n"), "stands here already"},
      {scene_with(two + "[[material]]\nname = \"glass\"\ndensity = 1\n"), "named 'glass' already"},
      {scene_with(two + "[[pair]]\nmaterial = \"glass\"\nwith = \"steel\"\nfriction = -1\n"), "must be"},
      {replaced(scene_with(two), "#wall", "material = \"wood\""), "no material is named 'wood'"},
      {replaced(scene_with("[material]\ndensity = 1\n"), "#wall", "material = \"wood\""), "[[material]]"},
      {scene_with("[material]\ndensity = 1\n[[pair]]\nmaterial = \"a\"\n"), "[[material]]"},
      {scene_with(two, "wall_friction = 0.3\n"), "stage.pair"},
  };
  for (const auto& [text, expected] : wrong)
    EXPECT_NE(message_of(text).find(expected), std::string::npos)
        << message_of(text) << "\n   for " << expected;
}

}  // namespace
}  // namespace talus::io
