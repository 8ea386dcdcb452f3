#include "io/scene/scene_places.hpp"

#include "io/scene/scene.hpp"

namespace talus::io {

namespace {

/// Whether words end where a message goes on: "cell" does not name "cells".
bool ends_at(const std::string& message, std::size_t end) {
  return end == message.size() || message[end - 1] == '\'' ||
         std::string(" :.,;").find(message[end]) != std::string::npos;
}

int line_named(const ScenePlaces& places, const std::string& message) {
  int line = 0;
  std::size_t first = std::string::npos, length = 0;
  for (const auto& [words, of] : places) {
    const std::size_t at = message.find(words);
    if (at == std::string::npos || !ends_at(message, at + words.size())) continue;
    // Words without a name are a part of any sentence: they count where it begins with them.
    if (at > 0 && words.find('\'') == std::string::npos) continue;
    if (at > first || (at == first && words.size() <= length)) continue;
    first = at;
    length = words.size();
    line = of;
  }
  return line;
}

}  // namespace

int line_of(const ScenePlaces& places, const std::string& key, const std::string& message) {
  const int named = line_named(places, message);
  // A table's name alone says less than that of one of its things.
  if (named > 0 && key.find_first_of(".[") == std::string::npos) return named;
  for (std::string path = key; !path.empty();) {
    if (const auto found = places.find(path); found != places.end()) return found->second;
    const std::size_t dot = path.find_last_of(".[");
    path.resize(dot == std::string::npos ? 0 : dot);
  }
  return named;
}

std::string key_of_sample(const Scene& scene, std::size_t k) {
  return scene.places.contains("sample[0]") ? "sample[" + std::to_string(k) + "]" : "sample";
}

SceneError error_in(const Scene& scene, const std::string& key, const std::string& message) {
  return {scene.source_file, line_of(scene.places, key, message), key, message};
}

}  // namespace talus::io
