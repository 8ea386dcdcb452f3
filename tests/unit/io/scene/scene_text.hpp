#pragma once

/// A small scene as text, and what the tests of its errors ask of a refusal.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/scene/scene.hpp"
#include "tests/unit/replaced.hpp"

namespace talus::io::scene_test {

inline const char* const file = "test.toml";

/// A small scene that is right, with one more line at a mark: "#top", "#material", "#sample", "#wall",
/// "#stage" or "#tail".
inline std::string scene_with(const std::string& mark = "#", const std::string& line = "") {
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

using test::replaced;

/// A grain and a wall `w`, of which `wall` says more, and then what follows: stages.
inline std::string scene_with_wall(const std::string& wall, const std::string& stages) {
  return R"(name = "walls"
[material]
density = 2600
[sample]
kind = "lattice"
cells = [1, 1, 1]
radius = 0.01
[[wall]]
name = "w"
)" + wall +
         "\n" + stages;
}

/// Line (from 1) on which `needle` stands.
inline int line_of(const std::string& text, const std::string& needle) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(text.find(needle));
  return 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
}

inline SceneError error_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    parse_scene(text, file, overrides);
  } catch (const SceneError& error) {
    return error;
  }
  ADD_FAILURE() << "accepted:\n" << text;
  return {"", 0, "", ""};
}

/// The text is refused at the line of `needle`, with `key`, and with `said` in the message.
inline void expect_refused(const std::string& text, const std::string& needle, const std::string& key,
                           const std::string& said) {
  const SceneError error = error_of(text);
  EXPECT_EQ(error.file(), file);
  EXPECT_EQ(error.line(), line_of(text, needle)) << error.what();
  EXPECT_EQ(error.key(), key) << error.what();
  EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
}

/// Refused where one line is added.
inline void expect_line_refused(const std::string& mark, const std::string& line, const std::string& key,
                                const std::string& said) {
  expect_refused(scene_with(mark, line), line, key, said);
}

}  // namespace talus::io::scene_test
