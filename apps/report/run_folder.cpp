#include "apps/report/run_folder.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "apps/shared/run_json_files.hpp"
#include "io/files/error.hpp"

namespace talus {

using nlohmann::json;

std::vector<std::filesystem::path> sources_in(const std::filesystem::path& directory) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory))
    for (const char* kind : {".h5", ".json", ".csv", ".toml"})
      if (entry.path().extension() == kind) files.push_back(entry.path());
  return files;
}

namespace {

std::string resolved_text(const std::filesystem::path& directory) {
  std::ifstream file(directory / "scene.resolved.toml", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A run that has ended knows how many steps it has had; one that failed may not have told or written its
/// last ones.
void demand_all_steps(const RunFolder& run) {
  const std::string status = run.summary.value("status", "running");
  const auto told = run.summary.value("steps", std::int64_t{0});
  const auto rows = std::ssize(run.steps["converged"]);
  if (status == "running" || rows == told || status == "failed") return;
  throw io::FileError(
      (run.directory / "steps.csv").string(),
      fmt::format("has {} whole rows with column `converged`, run.json beside it speaks of {} steps: restore "
                  "the one that has been changed, or run the scene anew in another directory",
                  rows, told));
}

}  // namespace

std::string damage_of_frames(const std::filesystem::path& directory) {
  const std::filesystem::path results = directory / "results.h5";
  try {
    if (std::filesystem::exists(results)) io::frame_count(results.string());
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

std::vector<std::string> sentences_of(const RunFolder& run, const char* key) {
  std::vector<std::string> sentences;
  for (const json& sentence : run.summary.value(key, json::array()))
    if (sentence.is_string()) sentences.push_back(sentence.get<std::string>());
  return sentences;
}

std::optional<io::Scene> resolved_scene(const std::filesystem::path& directory) {
  try {
    return io::parse_scene(resolved_text(directory), (directory / "scene.resolved.toml").string());
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

RunFolder read_run_folder(const std::filesystem::path& directory) {
  if (!std::filesystem::exists(directory / "run.json"))
    throw std::invalid_argument(fmt::format("{}: no run was begun there", directory.string()));
  RunFolder run;
  run.directory = directory;
  const json all = read_run_json(directory);
  run.provenance = all.value("provenance", json::object());
  run.summary = all.value("summary", json::object());
  run.status = read_status_json(directory);
  run.resolved = resolved_text(directory);
  run.scene = resolved_scene(directory);  // its words need the scene; everything else is told without it
  run.steps = io::read_columns(
      directory / "steps.csv",
      {"step", "time", "time_step", "contacts", "active", "iterations", "error_rms", "error_max", "balance",
       "velocity_error", "overlap", "kinetic_translation", "kinetic_rotation", "wall_s", "converged"});
  demand_all_steps(run);
  return run;
}

}  // namespace talus
