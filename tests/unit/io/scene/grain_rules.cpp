/// [[insert]] and [[remove]] of scene files.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "io/scene/scene.hpp"
#include "tests/unit/replaced.hpp"

namespace talus::io::grain_rules_test {
namespace {

using test::replaced;

const std::string before = R"(time_step = 1e-3
[[material]]
name = "glass"
density = 2500
[[material]]
name = "steel"
density = 7800
[[stage]]
name = "fill"
end = { steps = 5 }
)";

const std::string insert = R"([[insert]]
name = "rain"
material = "steel"
radius_distribution = "uniform"
radius_min = 0.001
radius_max = 0.002
rate = 100
count = 50
velocity = [0, 0, -1]
stage = "fill"
until = 2
region = { shape = "disc", centre = [0, 0, 1], radius = 0.1 }
)";

const std::string remove = R"([[remove]]
at = [0.5, 1]
material = "glass"
region = { shape = "beyond", point = [0, 0, -1], normal = [0, 0, -1] }
)";

TEST(GrainRules, AreReadAndASceneWithAnInsertionNeedsNoSample) {
  const Scene scene = parse_scene(before + insert + remove, "rules.toml");
  EXPECT_TRUE(scene.samples.empty());
  ASSERT_EQ(scene.setup.inserts.size(), 1u);
  const InsertRule& rule = scene.setup.inserts.front();
  EXPECT_EQ(rule.density, 7800);
  EXPECT_EQ(rule.material, 1);
  EXPECT_EQ(rule.times.until, 2);
  EXPECT_EQ(rule.times.stage, "fill");
  EXPECT_FALSE(rule.mass);
  ASSERT_EQ(scene.setup.removes.size(), 1u);
  EXPECT_EQ(scene.setup.removes.front().name, "remove-1");
  EXPECT_EQ(scene.setup.removes.front().material, Material{0});
  EXPECT_TRUE(std::isinf(scene.setup.removes.front().times.until));
}

TEST(GrainRules, TheResolvedSceneIsTheSameScene) {
  const std::string text = resolved_scene(parse_scene(before + insert + remove, "rules.toml"));
  const Scene again = parse_scene(text, "rules.toml");
  EXPECT_EQ(resolved_scene(again), text);
  EXPECT_EQ(again.setup.inserts.front().region.kind, Region::Kind::disc);
  EXPECT_EQ(again.setup.removes.front().at, (std::vector<double>{0.5, 1}));
}

TEST(GrainRules, MistakesAreNamedWithARemedy) {
  const auto expect = [](const std::string& rules, const std::string& part) {
    std::string error;
    try {
      parse_scene(before + rules, "rules.toml");
    } catch (const SceneError& refused) {
      error = refused.what();
    }
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error;
    EXPECT_NE(error.find("rules.toml:"), std::string::npos) << "no line: " << error;
  };
  expect(replaced(insert, "rate = 100", "rate = 0"), "insert[0].rate: must be > 0");
  expect(replaced(insert, "\"steel\"", "\"steal\""), "did you mean 'steel'");
  expect(replaced(insert, "stage = \"fill\"", "stage = \"full\""), "did you mean 'fill'");
  expect(replaced(replaced(insert, "rate = 100\n", ""), "count = 50\n", ""),
         "needs count, mass, rate or mass_rate");
  expect(replaced(insert, "count = 50", "mass_rate = 3"), "not both");
  expect(replaced(insert, "until = 2", "until = 2\nfrom = 3"), "must be later than from");
  expect(replaced(insert, "radius = 0.1 }", "radius = 0.0015 }"), "has no room for the largest grain");
  expect(replaced(insert, "region = {", "regions = {"), "unknown key");
  expect("[[insert]]\ncount = 1\nradius = 1\n", "insert[0].region: missing");
  expect(insert + insert, "another insert is named 'rain'");
  for (const std::string times : {"[1, 0.5]", "[1, 1]"})
    expect(insert + replaced(remove, "[0.5, 1]", times), "times must ascend");
  expect(insert + replaced(remove, "[0.5, 1]", "[0.5, 1]\ninterval = 0.1"), "no meaning with `at`");
  expect(insert + replaced(remove, "[0.5, 1]", "[\"half\"]"), "remove[0].at");
  expect(replaced(insert, "count = 50", "mass = 1e-12"), "less than the smallest grain has");
  expect(insert + replaced(remove, "\"beyond\", point = [0, 0, -1], normal = [0, 0, -1]",
                           "\"disc\", centre = [0, 0, 0], radius = 1"),
         "'disc' cannot be used here");
}

}  // namespace
}  // namespace talus::io::grain_rules_test
