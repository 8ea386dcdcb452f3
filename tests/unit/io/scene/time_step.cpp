#include <gtest/gtest.h>

#include <string>

#include "io/scene/scene.hpp"
#include "io/scene/scene_error.hpp"

namespace talus::io {
namespace {

std::string timed_scene_with(const std::string& top, const std::string& stages) {
  return "box = true\n" + top +
         "\n[material]\ndensity = 2600\n[sample]\nkind = \"lattice\"\ncells = [2, 2, 2]\nradius = 0.01\n" +
         stages;
}

TEST(TimeStepKey, IsANumberOrAuto) {
  const std::string text =
      timed_scene_with("gravity = [0, 0, -9.81]\ntime_step = \"auto\"\ntime_step_max = 1e-3",
                       "[[stage]]\nname = \"a\"\ntime_step_min = 1e-6\nend = { time = 1 }\n"
                       "[[stage]]\nname = \"b\"\ntime_step = 1e-4\nend = { time = 1 }\n");
  for (const Scene& scene : {parse_scene(text, "s.toml"),
                             parse_scene(resolved_scene(parse_scene(text, "s.toml")), "resolved.toml")}) {
    const Stage &a = scene.setup.stages[0], &b = scene.setup.stages[1];
    EXPECT_TRUE(a.chooses_time_step);
    EXPECT_EQ(a.time_step_max, 1e-3);
    EXPECT_EQ(a.time_step_min, 1e-6);
    EXPECT_FALSE(b.chooses_time_step);
    EXPECT_EQ(b.time_step, 1e-4);
  }
  const Scene fixed = parse_scene(
      timed_scene_with("gravity = [0, 0, -1]\ntime_step = \"auto\"", "[[stage]]\nend = { steps = 1 }\n"),
      "s.toml", {"time_step=2e-3"});
  EXPECT_FALSE(fixed.setup.stages[0].chooses_time_step);
  EXPECT_EQ(fixed.setup.stages[0].time_step, 2e-3);
}

TEST(TimeStepKey, SaysWhatItLacks) {
  const auto message = [](const std::string& top) {
    try {
      parse_scene(timed_scene_with(top, "[[stage]]\nend = { steps = 1 }\n"), "s.toml");
    } catch (const SceneError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_NE(message("time_step = \"auto\"").find("time_step_max"), std::string::npos);
  EXPECT_EQ(message("time_step = \"auto\"\ngravity = [0, 0, -1]"), "none");
  EXPECT_NE(message("time_step = \"often\"").find("\"auto\""), std::string::npos);
  EXPECT_NE(message("time_step = 1e-3\ntime_step_max = 1e-3").find("only with"), std::string::npos);
}

}  // namespace
}  // namespace talus::io
