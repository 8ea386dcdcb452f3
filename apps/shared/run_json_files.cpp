#include "apps/shared/run_json_files.hpp"

#include <fmt/format.h>

#include <fstream>

#include "io/files/error.hpp"

namespace talus {

namespace {

using nlohmann::json;

constexpr const char* remedy =
    "`talus run ... --resume` writes it anew from a checkpoint, where there is one";

/// Discarded where it is no JSON.
json parsed(const std::filesystem::path& path) {
  std::ifstream file(path);
  return json::parse(file, nullptr, false);
}

}  // namespace

json read_run_json(const std::filesystem::path& directory) {
  const std::filesystem::path path = directory / "run.json";
  if (!std::filesystem::exists(path)) return json::object();
  json read = parsed(path);
  const auto sound = [&](const char* part) { return !read.contains(part) || read[part].is_object(); };
  if (!read.is_object() || !sound("provenance") || !sound("summary"))
    throw io::FileError(path.string(), fmt::format("is damaged; {}", remedy));
  return read;
}

json read_status_json(const std::filesystem::path& directory) {
  json read = parsed(directory / "status.json");
  return read.is_object() ? read : json::object();
}

std::string damaged_value(const std::filesystem::path& directory, const json::exception& error) {
  return fmt::format("{}: run.json or status.json there is damaged ({}); {}", directory.string(),
                     error.what(), remedy);
}

}  // namespace talus
