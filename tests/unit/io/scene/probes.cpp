/// [[probe]] and [[field]] of scene files.

#include <gtest/gtest.h>

#include <string>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"
#include "tests/unit/io/scene/scene_text.hpp"

namespace talus::io::probe_scene_test {
namespace {

using scene_test::expect_refused;
using scene_test::scene_with;

const std::string gate = R"([[probe]]
name = "gate"
every = 0.01
region = { shape = "disc", centre = [0, 0, 0.02], axis = [0, 0, -2], radius = 0.03 }
)";
const std::string zone = R"([[probe]]
region = { shape = "box", low = [0, 0, 0], high = [0.05, 0.1, 0.05] }
)";
const std::string grid = R"([[field]]
name = "flow"
low = [0, 0, 0]
high = [0.1, 0.1, 0.1]
cells = [10, 10, 5]
width = 0.03
)";

TEST(ProbesOfScenes, AreReadAndReportAsOftenAsTablesUnlessTheySay) {
  const Scene scene =
      parse_scene(scene_with("#tail", gate + zone + grid + "[output]\ntables_every = 7"), "p.toml");
  ASSERT_EQ(scene.setup.probes.size(), 2u);
  EXPECT_EQ(scene.setup.probes[0].every, 0.01);
  EXPECT_FALSE(scene.setup.probes[0].every_steps);
  EXPECT_EQ(scene.setup.probes[1].name, "probe-2");
  EXPECT_EQ(scene.setup.probes[1].every_steps, 7);
  ASSERT_EQ(scene.setup.fields.size(), 1u);
  EXPECT_EQ(scene.setup.fields[0].cells, (std::array<std::int64_t, 3>{10, 10, 5}));
  const std::string text = resolved_scene(scene);
  EXPECT_EQ(resolved_scene(parse_scene(text, "p.toml")), text);
}

void expect_mistake(const std::string& text, const std::string& needle, const std::string& key,
                    const std::string& said) {
  expect_refused(scene_with("#tail", text), needle, key, said);
}

TEST(ProbesOfScenes, MistakesAreNamedWithTheirLineAndARemedy) {
  using test::replaced;
  expect_mistake(replaced(gate, "axis = [0, 0, -2]", "axis = [0, 0, 0]"), "region", "probe[0].region",
                 "`axis` must not be zero");
  expect_mistake("[[probe]]\nregion = { shape = \"plane\", point = [0, 0, 0], normal = [0, 0, 0] }", "region",
                 "probe[0].region", "`normal` must not be zero");
  expect_mistake(replaced(gate, "every = 0.01", "every = 0"), "every = 0", "probe[0].every", "must be > 0");
  expect_mistake(replaced(gate, "every = 0.01", "every_steps = 0"), "every_steps = 0", "probe[0].every_steps",
                 "1 to");
  expect_mistake(gate + replaced(gate, "every = 0.01", "every = 1"), "name = \"gate\"\nevery = 1",
                 "probe[1].name", "another probe is named 'gate' already");
  expect_mistake("[[probe]]\nname = \"empty\"", "[[probe]]", "probe[0].region", "missing");
  expect_mistake(replaced(zone, "high = [0.05", "high = [-1"), "region", "probe[0].region", "`high`");
  expect_mistake(replaced(grid, "width = 0.03", "width = 0.001"), "[[field]]", "field[0]", "`width`");
  expect_mistake(replaced(grid, "cells = [10, 10, 5]", "cells = [9999, 9999, 9999]"), "[[field]]", "field[0]",
                 "cells");
}

TEST(ProbesOfScenes, OneBehindAWallIsRefusedWhenTheWallsHaveTheirPlaces) {
  const auto placed = [](const std::string& region) {
    Scene scene =
        parse_scene(scene_with("#tail", "[[probe]]\nname = \"lost\"\nregion = " + region), "p.toml");
    Sample grains;
    grains.x = {{0.05, 0.05, 0.01}};
    grains.radius = {0.01};
    grains.density = 2600;
    try {
      place_walls(scene, grains);
    } catch (const SceneError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string box = "{ shape = \"box\", low = [0, 0, -0.2], high = [0.1, 0.1, ";
  EXPECT_EQ(placed(box + "0.01] }"), "");
  EXPECT_NE(placed(box + "-0.01] }").find("probe 'lost' lies behind wall 'z-'"), std::string::npos);
  EXPECT_NE(
      placed("{ shape = \"plane\", point = [0, 0, -0.01], normal = [0, 0, 1] }").find("behind wall 'z-'"),
      std::string::npos);
  EXPECT_NE(
      placed("{ shape = \"disc\", centre = [-0.2, 0, 0], axis = [0, 0, 1], radius = 0.1 }").find("'x-'"),
      std::string::npos);
  EXPECT_EQ(placed("{ shape = \"disc\", centre = [-0.2, 0, 0.1], axis = [0, 0, 1], radius = 0.3 }"), "");
  EXPECT_EQ(placed("{ shape = \"plane\", point = [0, 0, 0.05], normal = [1, 0, 1] }"), "");
}

}  // namespace
}  // namespace talus::io::probe_scene_test
