#pragma once

/// Reading one TOML table with the table of keys.

#include <string>
#include <vector>

#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/detail/scene_text.hpp"

namespace talus::io::detail {

/// The node's value as the key's kind; fails at the node when its type or range is wrong, or a number is
/// larger than any of its unit can be. `path` names the key in errors.
Value read_value(const toml::node& node, const std::string& path, const KeyText& key,
                 const std::string& expected);

/// Fails when `table` has a key that is not in `known`, with what was probably meant.
void refuse_unknown(const toml::table& table, const std::string& path, const std::vector<std::string>& known);

/// The elements of an array of tables `name` of `parent`; none when it is left out. `path` is that of the
/// array.
std::vector<const toml::table*> tables_at(const toml::table& parent, const std::string& name,
                                          const std::string& path);

/// Names of walls, stages and materials stand in columns of CSV files, in paths and in overrides.
bool may_be_in_name(char c);

/// Fails when a table's own `name` has other characters.
void check_name(const toml::table& table, const std::string& path, const std::string& name);

inline std::string joined(const std::string& path, const std::string& name) {
  return path.empty() ? name : path + "." + name;
}

/// Fills `part` from `table`, whose own tables (read by the caller) are named in `subtables`. `path` is that
/// of the table.
template <class Part>
void read_table(const toml::table& table, const std::string& path, const Section<Part>& section,
                const std::vector<std::string>& subtables, Part& part) {
  std::vector<std::string> known = subtables;
  for (const Key<Part>& key : section.keys) known.push_back(key.name);
  refuse_unknown(table, path, known);
  for (const Key<Part>& key : section.keys) {
    const toml::node* node = table.get(key.name);
    if (!node) continue;
    const std::string name = joined(path, key.name);
    const std::string expected = expected_text(key);
    if (key.automatic && node->value<std::string>() == "auto") {
      key.set(part, *key.automatic);
      continue;
    }
    const Value value = read_value(*node, name, key, expected);
    if (const auto* text = std::get_if<std::string>(&value); text && !key.choices.empty())
      if (std::find(key.choices.begin(), key.choices.end(), *text) == key.choices.end())
        fail_at(*node, name,
                fmt::format("'{}' is not one of the choices{}", *text, hint(*text, key.choices)));
    key.set(part, value);
  }
  // Whether a key applies is known once all are read.
  for (const Key<Part>& key : section.keys) {
    const toml::node* node = table.get(key.name);
    const bool applies = !key.applies || key.applies(part);
    if (node && !applies) fail_at(*node, joined(path, key.name), "has a meaning only with: " + key.when);
    if (!node && applies && key.required)
      fail_at(table, joined(path, key.name), "missing; expected: " + expected_text(key));
  }
}

}  // namespace talus::io::detail
