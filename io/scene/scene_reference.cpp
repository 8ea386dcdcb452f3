#include <algorithm>
#include <string_view>

#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/detail/scene_text.hpp"
#include "io/scene/scene.hpp"

namespace talus::io {

namespace {

using namespace detail;

constexpr const char* introduction = R"(# Scenes

A scene is one TOML file with everything a run depends on. Units are SI. This page is written by
`talus scene-reference` from the table that reads the files, so it knows every key there is; a key that is not
here is refused, with its line, and so are numbers beyond 1e15 in m, m/s, rad/s and 1/s, or beyond 1e30
in Pa, N, m² and kg/s.

```toml
time_step = 5e-4

[material]
density = 2600
friction = 0.35

[sample]
kind = "deposition"
count = 500
base = [0.15, 0.15]
radius_distribution = "uniform"
radius_min = 0.009
radius_max = 0.011

[[wall]]
name = "floor"
side = "z-"

[[stage]]
gravity = [0, 0, -9.81]
end = { equilibrium = 1e-3, time = 2.0 }
```

* Scenes to begin from stand in `apps/scenes/`.
* `--set KEY=VALUE` changes a key for one run: `--set solver.tolerance=1e-4`. Elements of arrays go by number or
  by name: `--set stage.0.time_step=1e-4`, `--set stage.shear.friction=0.5`, `--set wall.z+.pressure=2e4`,
  `--set stage.shear.load.z+.velocity='[0, 0, -0.1]'`.
* The scene as it was run, with every default spelled out, is written beside the results as
  `scene.resolved.toml`. It is a scene itself.
* A mistake is reported with file, line and key, and with what was probably meant, before anything is written;
  the exit code is 2.
)";

/// Default of the key as the reference says it.
template <class Part>
std::string default_text(const Key<Part>& key) {
  if (key.required) return "required";
  if (!key.default_text.empty()) return key.default_text;
  const std::string text = text_of(key, Part{});
  return text.empty() ? "none" : "`" + text + "`";
}

/// Of a line, but of tables [characters].
constexpr std::size_t page_width = 110;

/// The text in lines of at most `page_width`; a blank in code may become the end of a line, which
/// Markdown takes for a blank.
std::string in_lines(std::string_view text) {
  std::string out;
  std::size_t used = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    // Bytes that go on with a character of UTF-8 begin with the bits 10.
    const auto length = static_cast<std::size_t>(std::ranges::count_if(
        word, [](char byte) { return (static_cast<unsigned char>(byte) & 0xC0) != 0x80; }));
    const bool fits = used + 1 + length <= page_width;
    if (used > 0) out += fits ? ' ' : '\n';
    used = used > 0 && fits ? used + 1 + length : length;
    out += word;
  }
  return out;
}

template <class Part>
std::string section_text(const Section<Part>& section) {
  std::string out = fmt::format("\n## {}\n\n", section.header.empty() ? "Top" : "`" + section.header + "`");
  if (!section.meaning.empty()) out += in_lines(section.meaning) + "\n\n";
  out += "| key | type | unit | default | range | meaning |\n| --- | --- | --- | --- | --- | --- |\n";
  for (const Key<Part>& key : section.keys)
    out += fmt::format("| `{}` | {} | {} | {} | {} | {}{} |\n", key.name, type_text(key), key.unit,
                       default_text(key), range_text(key.range), key.meaning,
                       key.when.empty() ? "" : " (" + key.when + ")");
  return out;
}

}  // namespace

std::string scene_reference() {
  std::string out = introduction;
  for_each_section(scene_keys(), [&](const auto& section) { out += section_text(section); });
  return out;
}

}  // namespace talus::io
