#pragma once

#include <toml++/toml.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "io/scene/detail/scene_read.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Reads every [[insert]] and [[remove]] into the setup of a scene whose materials and stages are read.
/// Throws SceneError.
void read_grain_rules(const toml::table& root, Scene& scene);

/// A name of its own, unique among `earlier` rules, or the one that its number gives. Throws SceneError.
template <class Rule>
void settle_name(const toml::table& table, const std::string& path, const char* kind,
                 const std::vector<Rule>& earlier, Rule& rule) {
  if (!table.get("name"))
    rule.name = fmt::format("{}-{}", kind, earlier.size() + 1);
  else
    check_name(table, path, rule.name);
  if (std::ranges::find(earlier, rule.name, &Rule::name) == earlier.end()) return;
  const toml::node* at = table.get("name");
  fail_at(at ? *at : table, path + ".name", fmt::format("another {} is named '{}' already", kind, rule.name));
}

/// The table `region`, of one of these shapes. Throws SceneError, also where there is none.
Region needed_region(const toml::table& table, const std::string& path,
                     std::initializer_list<Region::Kind> shapes);

}  // namespace talus::io::detail
