#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "io/scene/detail/scene_keys.hpp"
#include "io/scene/scene.hpp"

namespace talus::io {

namespace {

const detail::Key<SolverSettings>& method_key() {
  const auto& keys = detail::scene_keys().solver.keys;
  return *std::ranges::find(keys, "method", &detail::Key<SolverSettings>::name);
}

}  // namespace

std::vector<std::string> solver_methods() {
  return method_key().choices;
}

SolverMethod solver_method(const std::string& name) {
  const detail::Key<SolverSettings>& key = method_key();
  if (std::ranges::find(key.choices, name) == key.choices.end())
    throw std::invalid_argument(
        fmt::format("method '{}' is not known; there are {}", name, fmt::join(key.choices, ", ")));
  SolverSettings settings;
  key.set(settings, name);
  return settings.method;
}

}  // namespace talus::io
