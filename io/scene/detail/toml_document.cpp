#include "io/scene/detail/toml_document.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/detail/spelling.hpp"
#include "io/scene/scene_error.hpp"

namespace talus::io::detail {

namespace {

/// One override, taken apart: "stage[0].time_step=1e-4" -> {"stage", "0", "time_step"} and the text of the
/// value.
struct Override {
  std::string source;  ///< what an error names
  std::vector<std::string> path;
  std::string value;

  [[noreturn]] void fail(const std::string& message) const { throw SceneError(source, 0, "", message); }
};

Override take_apart(const std::string& text) {
  Override result{"--set " + text, {}, {}};
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) result.fail("an override reads KEY=VALUE, e.g. solver.tolerance=1e-4");
  result.value = text.substr(equals + 1);
  std::string segment;
  const auto close_segment = [&] {
    if (segment.empty()) result.fail("a part of the key is empty");
    result.path.push_back(std::exchange(segment, {}));
  };
  bool after_bracket = false;
  for (const char c : text.substr(0, equals)) {
    if (c == ' ' || c == '"') continue;
    if (c == ']') {
      close_segment();
      after_bracket = true;
    } else if (c == '.' || c == '[') {
      if (!after_bracket) close_segment();
      after_bracket = false;
    } else {
      segment += c;
    }
  }
  if (!after_bracket) close_segment();
  return result;
}

/// Parses "value = TEXT" so that the nodes carry the override as their source; empty when TEXT is not one
/// TOML value.
std::optional<toml::table> parse_value(const std::string& text, const std::string& source) {
  try {
    toml::table parsed = toml::parse("value = " + text, source);
    if (parsed.size() == 1) return parsed;
  } catch (const toml::parse_error&) {  // not TOML: the caller takes it as a text
  }
  return std::nullopt;
}

/// Puts the one value of `parsed` at `key` of `table` and returns it there. Moving a node keeps its source.
toml::node& insert(toml::table& table, const std::string& key, toml::table&& parsed) {
  parsed.get("value")->visit([&](auto& node) { table.insert_or_assign(key, std::move(node)); });
  return *table.get(key);
}

/// Stages need no name: those without have that of their number.
void name_stages(toml::table& root) {
  toml::array* stages = root["stage"].as_array();
  if (!stages) return;
  for (std::size_t k = 0; k < stages->size(); ++k)
    if (toml::table* stage = (*stages)[k].as_table(); stage && !stage->contains("name"))
      stage->insert("name", fmt::format("stage-{}", k + 1));
}

/// "" when it has none.
std::string name_of(const toml::array& array, std::size_t k) {
  const toml::table* table = array[k].as_table();
  if (!table) return "";
  for (const char* key : {"name", "wall"})
    if (const auto name = (*table)[key].value<std::string>()) return *name;
  return "";
}

/// Place in `array` of the element with this number or name.
std::optional<std::size_t> find_element(const toml::array& array, const std::string& segment) {
  for (std::size_t k = 0; k < array.size(); ++k)
    if (name_of(array, k) == segment) return k;
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(segment.data(), segment.data() + segment.size(), index);
  if (error == std::errc{} && end == segment.data() + segment.size() && index < array.size()) return index;
  return std::nullopt;
}

toml::node& element_of(toml::array& array, const std::string& segment, const Override& override) {
  if (const auto index = find_element(array, segment)) return array[*index];
  std::vector<std::string> names;
  for (std::size_t k = 0; k < array.size(); ++k)
    names.push_back(fmt::format("{} '{}'", k, name_of(array, k)));
  override.fail(fmt::format("no element '{}'; there are: {}", segment, listed(names)));
}

/// The node one segment further, made as a table when there is none.
toml::node& descend(toml::node& at, const std::string& segment, const Override& override) {
  if (toml::array* array = at.as_array()) return element_of(*array, segment, override);
  toml::table* table = at.as_table();
  if (!table) override.fail(fmt::format("'{}' stands under a key that holds a single value", segment));
  if (toml::node* next = table->get(segment)) return *next;
  return insert(*table, segment, *parse_value("{}", override.source));
}

/// A wall that `box = true` makes and the scene does not list gets an entry of its own, for the override to
/// change.
void list_wall_of_box(toml::table& root, const Override& override) {
  const auto& path = override.path;
  const bool of_box = root["box"].value<bool>() == true && path.size() > 2 && path[0] == "wall" &&
                      std::find(sides().begin(), sides().end(), path[1]) != sides().end();
  if (!of_box) return;
  if (!root.get("wall")) insert(root, "wall", *parse_value("[]", override.source));
  toml::array* walls = root["wall"].as_array();
  if (!walls || find_element(*walls, path[1])) return;
  toml::table entry = *parse_value("{name = " + quoted(path[1]) + "}", override.source);
  walls->push_back(std::move(*entry["value"].as_table()));
}

void apply(toml::table& root, const Override& override) {
  list_wall_of_box(root, override);
  toml::node* at = &root;
  for (std::size_t k = 0; k + 1 < override.path.size(); ++k) at = &descend(*at, override.path[k], override);
  std::optional<toml::table> parsed = parse_value(override.value, override.source);
  if (!parsed) parsed = parse_value(quoted(override.value), override.source);
  if (!parsed) override.fail("the value is not UTF-8");
  const std::string& last = override.path.back();
  if (toml::array* array = at->as_array()) {
    element_of(*array, last, override);
    parsed->get("value")->visit([&](auto& node) {
      array->replace(array->begin() + static_cast<std::ptrdiff_t>(*find_element(*array, last)),
                     std::move(node));
    });
  } else if (toml::table* table = at->as_table()) {
    insert(*table, last, std::move(*parsed));
  } else {
    override.fail(fmt::format("'{}' stands under a key that holds a single value", last));
  }
}

/// Throws SceneError for a key of many parts: TOML's reader goes down one call a part, and the stack ends.
void demand_short_keys(const std::string& text, const std::string& file) {
  constexpr int most_parts = 64;
  int line = 1, dots = 0;
  char quote = 0;
  for (const char c : text) {
    if (c == '\n') {
      ++line;
      quote = 0;
    } else if (quote != 0) {
      if (c == quote && quote != '#') quote = 0;
      continue;
    } else if (c == '"' || c == '\'' || c == '#') {
      quote = c;
    }
    if (c == '.' && ++dots >= most_parts)
      throw SceneError(file, line, "",
                       fmt::format("a key of more than {} parts; scenes have none", most_parts));
    if (c == '\n' || c == '=' || c == ',' || c == '{' || c == '}') dots = 0;
  }
}

}  // namespace

toml::table parse_document(const std::string& text, const std::string& file,
                           const std::vector<std::string>& overrides) {
  demand_short_keys(text, file);
  for (const std::string& override : overrides)
    demand_short_keys(override, "--set " + override.substr(0, 40));
  try {
    toml::table root = toml::parse(text, file);
    name_stages(root);
    for (const std::string& override : overrides) {
      apply(root, take_apart(override));
      name_stages(root);
    }
    return root;
  } catch (const toml::parse_error& error) {
    const std::string what(error.description());
    const bool bare = what.find("could not determine value type") != std::string::npos;
    throw SceneError(file, static_cast<int>(error.source().begin.line), "",
                     "not TOML: " + what + (bare ? "; texts stand in quotes, numbers have no units" : ""));
  }
}

void fail_at(const toml::node& at, const std::string& key, const std::string& message) {
  const toml::source_region& source = at.source();
  const std::string file = source.path ? *source.path : "scene";
  const bool from_override = file.starts_with("--set ");
  throw SceneError(file, from_override ? 0 : static_cast<int>(source.begin.line), key, message);
}

// Not toml++'s writer: version 3.3 writes a text that holds ''' and a line break as a literal string, which
// does not read back.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += {'\\', c};
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
    else
      out += c;
  }
  return out + '"';
}

}  // namespace talus::io::detail
