#include "io/scene/detail/scene_read.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <system_error>

#include "io/scene/detail/foreign_words.hpp"
#include "kernels/bodies/farthest.hpp"

namespace talus::io::detail {

namespace {

/// A text as a number, which it is from its first to its last letter.
struct TextAsNumber {
  bool is_number = false;  ///< also where no double holds it
  std::optional<double> value = {};
};
TextAsNumber as_number(const std::string& text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (end != text.data() + text.size() || error == std::errc::invalid_argument) return {};
  if (error != std::errc{}) return {true};
  return {true, number};
}

std::string found_text(const toml::node& node) {
  if (const auto* text = node.as_string()) {
    const std::string& held = text->get();
    // TOML's reader refuses such a number, so that an override with one is a text.
    if (const TextAsNumber number = as_number(held); number.is_number && !number.value)
      return held + ", which is out of the range of numbers";
    return fmt::format("the text '{}'", held);
  }
  if (const auto* whole = node.as_integer()) return fmt::format("the integer {}", whole->get());
  if (const auto* real = node.as_floating_point()) return "the real " + toml_text(real->get());
  if (const auto* truth = node.as_boolean()) return truth->get() ? "true" : "false";
  if (const auto* list = node.as_array())
    return list->empty() ? "an empty list" : fmt::format("a list of {}", list->size());
  return node.is_table() ? "a table" : "a date or time";
}

/// How TOML writes the number that a text means: overrides with ".1" and "1." are texts, and so is what
/// stands in quotes.
std::string number_meant(const toml::node& node) {
  const auto* text = node.as_string();
  if (text == nullptr) return "";
  const std::optional<double> number = as_number(text->get()).value;
  return number && std::isfinite(*number) ? ": write " + toml_text(*number) : "";
}

/// Products of numbers of these units have to stay numbers, as those of pressures and areas.
double largest_in(const std::string& unit) {
  for (const char* length : {"m", "m/s", "rad/s", "1/s"})
    if (unit == length) return farthest;
  for (const char* load : {"Pa", "N", "m²", "kg/s"})
    if (unit == load) return farthest * farthest;
  return std::numeric_limits<double>::infinity();
}

struct Reader {
  const std::string& path;
  const KeyText& key;
  const std::string& expected;

  template <class Number>
  Number within_range(const toml::node& node, Number value) const {
    const auto real = static_cast<double>(value);
    if (!std::isfinite(real)) fail_at(node, path, fmt::format("must be finite, got {}", real));
    if (!key.range.holds(real))
      fail_at(node, path, fmt::format("must be {}, got {}", range_text(key.range), value));
    if (const double largest = largest_in(key.unit); std::abs(real) > largest)
      fail_at(node, path, fmt::format("must be within {:g} {}, got {}", largest, key.unit, value));
    return value;
  }
  [[noreturn]] void wrong_type(const toml::node& node) const {
    fail_at(node, path, fmt::format("expected {}, got {}", expected, found_text(node)));
  }

  std::int64_t integer(const toml::node& node) const {
    if (const auto* real = node.as_floating_point();
        real != nullptr && real->get() == std::round(real->get()))
      fail_at(node, path,
              fmt::format("expected {}, got {}: write {:.0f}", expected, found_text(node), real->get()));
    // TOML's reader refuses such a number, too, so that an override with one is a text.
    constexpr auto most = static_cast<double>(std::numeric_limits<std::int64_t>::max());
    if (const auto* text = node.as_string())
      if (const TextAsNumber number = as_number(text->get());
          number.is_number && std::abs(number.value.value_or(most)) >= most)
        fail_at(
            node, path,
            fmt::format("expected {}, got {}, which is out of the range of integers", expected, text->get()));
    if (!node.is_integer()) wrong_type(node);
    return within_range(node, node.as_integer()->get());
  }
  double real(const toml::node& node) const {
    if (!node.is_number())
      fail_at(node, path,
              fmt::format("expected {}, got {}{}", expected, found_text(node), number_meant(node)));
    return within_range(node, *node.value<double>());
  }
};

template <class T, class Element>
std::vector<T> read_list(const toml::node& node, std::size_t length, const Reader& reader, Element element) {
  const toml::array* array = node.as_array();
  const bool fits = array && (length > 0 ? array->size() == length : !array->empty());
  if (!fits) reader.wrong_type(node);
  std::vector<T> values;
  for (const toml::node& entry : *array) values.push_back(element(entry));
  return values;
}

}  // namespace

Value read_value(const toml::node& node, const std::string& path, const KeyText& key,
                 const std::string& expected) {
  const Reader reader{path, key, expected};
  const Value& kind = key.kind;
  if (std::holds_alternative<bool>(kind)) {
    if (!node.is_boolean()) reader.wrong_type(node);
    return node.as_boolean()->get();
  }
  if (std::holds_alternative<std::string>(kind)) {
    if (!node.is_string()) reader.wrong_type(node);
    return node.as_string()->get();
  }
  if (std::holds_alternative<std::int64_t>(kind)) return reader.integer(node);
  if (std::holds_alternative<double>(kind)) return reader.real(node);
  if (const auto* list = std::get_if<std::vector<std::int64_t>>(&kind))
    return read_list<std::int64_t>(node, list->size(), reader,
                                   [&](const toml::node& n) { return reader.integer(n); });
  return read_list<double>(node, std::get<std::vector<double>>(kind).size(), reader,
                           [&](const toml::node& n) { return reader.real(n); });
}

void refuse_unknown(const toml::table& table, const std::string& path,
                    const std::vector<std::string>& known) {
  for (const auto& [key, node] : table) {
    const std::string name(key.str());
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    std::vector<std::string> elsewhere;
    for_each_section(scene_keys(), [&](const auto& section) {
      for (const auto& other : section.keys)
        if (other.name == name)
          elsewhere.push_back(section.header.empty() ? "the top of the file" : section.header);
    });
    const std::string meant = nearest(name, known);
    const std::string foreign = foreign_hint(name);
    const std::string help = !foreign.empty()                      ? foreign
                             : meant.empty() && !elsewhere.empty() ? "; it belongs in " + listed(elsewhere)
                                                                   : hint(name, known);
    fail_at(node, joined(path, name), "unknown key" + help);
  }
}

std::vector<const toml::table*> tables_at(const toml::table& parent, const std::string& name,
                                          const std::string& path) {
  const toml::node* node = parent.get(name);
  if (!node) return {};
  const toml::array* array = node->as_array();
  if (!array) {
    const bool of_stage = path.starts_with("stage[");
    fail_at(*node, path,
            fmt::format("must be an array of tables: write [[{}{}]]", of_stage ? "stage." : "", name));
  }
  std::vector<const toml::table*> tables;
  for (const toml::node& element : *array) {
    if (!element.is_table()) fail_at(element, path, "must hold tables only");
    tables.push_back(element.as_table());
  }
  return tables;
}

bool may_be_in_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '+' || c == '-' || c == '_';
}

void check_name(const toml::table& table, const std::string& path, const std::string& name) {
  if (name.empty() || !std::all_of(name.begin(), name.end(), may_be_in_name))
    fail_at(*table.get("name"), joined(path, "name"),
            fmt::format("must be made of letters, digits, +, - and _, got '{}'", name));
  // Names of files and columns are made of it, and file systems end at 255 bytes.
  constexpr std::size_t longest = 100;
  if (name.size() > longest)
    fail_at(*table.get("name"), joined(path, "name"),
            fmt::format("has {} characters; at most {} are taken", name.size(), longest));
}

}  // namespace talus::io::detail
