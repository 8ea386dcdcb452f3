#include "io/scene/detail/places_read.hpp"

#include <fmt/format.h>

#include <utility>

namespace talus::io::detail {

namespace {

/// What has no name is named by its number.
std::string name_of(const toml::table& table, const std::string& kind, std::size_t k) {
  return table["name"].value<std::string>().value_or(fmt::format("{}-{}", kind, k + 1));
}

class Collector {
 public:
  explicit Collector(const std::string& file) : file_(file) {}

  /// `named`: words of the table; its keys follow behind `between`.
  void add(const toml::table& table, const std::string& named, const std::string& between) {
    for (const auto& [key, node] : table) {
      const std::string words = named + between + std::string(key.str());
      note(words, node);
      if (const toml::table* inner = node.as_table()) add(*inner, words, ".");
      if (const toml::array* tables = node.as_array(); named.empty() && tables != nullptr)
        add_named(*tables, std::string(key.str()));
    }
  }

  ScenePlaces places;

 private:
  void note(const std::string& words, const toml::node& node) {
    const toml::source_region& source = node.source();
    const bool of_file = source.path && *source.path == file_;
    places.emplace(words, of_file ? static_cast<int>(source.begin.line) : 0);
  }

  void add_named(const toml::array& tables, const std::string& kind) {
    for (std::size_t k = 0; k < tables.size(); ++k) {
      const toml::node& node = tables[k];
      const toml::table* table = node.as_table();
      if (table == nullptr) continue;
      const std::string numbered = fmt::format("{}[{}]", kind, k);
      note(numbered, node);
      add(*table, numbered, ".");
      const std::string words = fmt::format("{} '{}'", kind, name_of(*table, kind, k));
      note(words, node);
      add(*table, words, ": ");
      // As two of them are named.
      note(fmt::format("{}s '{}'", kind, name_of(*table, kind, k)), node);
    }
  }

  std::string file_;
};

}  // namespace

ScenePlaces places_of(const toml::table& root, const std::string& file) {
  Collector found(file);
  found.add(root, "", "");
  return std::move(found.places);
}

}  // namespace talus::io::detail
