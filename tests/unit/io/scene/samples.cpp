/// [[sample]]: several samples in one scene, bodies with names, regions, distributions of radii.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "apps/shared/state_sample.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::samples_test {
namespace {

const std::string before = "time_step = 1e-3\n[material]\ndensity = 2500\n";
const std::string after = "\n[[stage]]\nend = { steps = 5 }\n";

std::string error_of(const std::string& samples) {
  try {
    parse_scene(before + samples + after, "samples.toml");
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

const std::string two = R"([[sample]]
name = "bed"
kind = "lattice"
radius = 0.01
spacing = 1.1
origin = [0, 0, 0.5]
region = { shape = "cylinder", start = [0, 0, 0], end = [0, 0, 1], radius = 0.2 }
[[sample]]
kind = "body"
name = "ball"
radius = 0.05
position = [0, 0, 2]
velocity = [0, 0, -1]
angular_velocity = [1, 2, 3]
)";

TEST(Samples, SeveralAreReadWithTheirBodies) {
  const Scene scene = parse_scene(before + two + after, "samples.toml");
  ASSERT_EQ(scene.samples.size(), 2u);
  EXPECT_EQ(scene.samples[0].region->radius, 0.2);
  EXPECT_EQ(scene.samples[1].velocity, Vec3(0, 0, -1));
  ASSERT_EQ(scene.setup.named.size(), 1u);
  EXPECT_EQ(scene.setup.named[0].name, "ball");
}

TEST(Samples, TheResolvedSceneIsTheSameScene) {
  const Scene scene = parse_scene(before + two + after, "samples.toml");
  const std::string text = resolved_scene(scene);
  const Scene again = parse_scene(text, "samples.toml");
  EXPECT_EQ(resolved_scene(again), text);
  EXPECT_EQ(again.samples[0].region->end, Vec3(0, 0, 1));
  EXPECT_EQ(again.samples[1].angular_velocity, Vec3(1, 2, 3));
}

/// A run that was begun before these keys existed goes on: its scene, resolved, is still the same text.
TEST(Samples, OneSampleIsResolvedWithoutTheKeysOfSeveral) {
  const Scene scene = parse_scene(
      before + "[sample]\nkind = \"lattice\"\ncells = [2, 2, 2]\nradius = 0.01\n" + after, "s.toml");
  const std::string text = resolved_scene(scene);
  const std::size_t begin = text.find("[sample]");
  const std::string sample = text.substr(begin, text.find("\n[", begin) - begin);
  for (const char* key : {"origin", "velocity", "name = \"\""})
    EXPECT_EQ(sample.find(key), std::string::npos) << key << " in\n" << sample;
  EXPECT_EQ(text.find("[[sample]]"), std::string::npos);
}

TEST(Samples, OverridesNameOneOfSeveral) {
  const Scene scene = parse_scene(before + two + after, "samples.toml", {"sample.ball.radius=0.06"});
  EXPECT_EQ(scene.samples[1].radii.max, 0.06);
}

TEST(Samples, DistributionsAreReadAndWritten) {
  const std::string grading =
      "[sample]\nkind = \"lattice\"\ncells = [2, 2, 2]\nradius_distribution = \"sieve\"\n"
      "sieve_size = [0.001, 0.002, 0.004]\nsieve_passing = [0, 30, 100]\n";
  const Scene scene = parse_scene(before + grading + after, "samples.toml");
  EXPECT_EQ(scene.samples[0].radii.sizes.size(), 3u);
  EXPECT_EQ(parse_scene(resolved_scene(scene), "s").samples[0].radii.parts, scene.samples[0].radii.parts);
}

TEST(Samples, MistakesAreNamedWithARemedy) {
  const auto expect = [](const std::string& samples, const std::string& part) {
    const std::string error = error_of(samples);
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error;
  };
  const std::string body = "[[sample]]\nkind = \"body\"\nradius = 1\nposition = [0, 0, 0]\n";
  expect(body, "a body needs a name");
  expect(body + "name = \"a\"\n" + body + "name = \"a\"\n", "another sample is named 'a'");
  expect(
      "[sample]\nkind = \"lattice\"\nradius = 1\nregion = { shape = \"disc\", centre = [0, 0, 0], radius = 3 "
      "}\n",
      "'disc' cannot be used here");
  expect(
      "[sample]\nkind = \"lattice\"\nradius = 1\nregion = { shape = \"box\", low = [0, 0, 0], high = [1, 1, "
      "1] }\n",
      "has no room for the largest grain");
  expect(
      "[sample]\nkind = \"lattice\"\nradius = 1\nregion = { shape = \"box\", low = [0, 0, 0], high = [1, 0, "
      "1] }\n",
      "must exceed");
  expect(
      "[sample]\nkind = \"lattice\"\ncells = [1, 1, 1]\nradius_distribution = \"sieve\"\nsieve_size = [1, "
      "2]\n"
      "sieve_passing = [0, 90]\n",
      "100 per cent");
  expect(body + "name = \"a\"\nregion = { shape = \"box\", low = [0, 0, 0], high = [1, 1, 1] }\n",
         "only with: kind = lattice");
}

TEST(Samples, OfAStateWarnOfSurfacesThatHadMoved) {
  const Scene scene = parse_scene(before + two + R"([[wall]]
name = "shell"
shape = "cylinder"
start = [0, -1, 0]
end = [0, 1, 0]
radius = 3
inside = true
[[wall]]
name = "floor"
side = "z-"
position = 0
)" + after,
                                  "samples.toml");
  std::vector<WallReport> walls(3);
  walls[0].name = "shell", walls[1].name = "floor", walls[2].name = "gone";
  EXPECT_TRUE(warnings_of_surfaces(walls, scene).empty());
  for (WallReport& wall : walls) wall.pose.moved = true;
  const std::vector<std::string> warnings = warnings_of_surfaces(walls, scene);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("wall 'shell' had moved"), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace talus::io::samples_test
