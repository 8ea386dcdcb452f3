#pragma once

/// The directory of a run as a page needs it.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/results/csv_reader.hpp"
#include "io/scene/scene.hpp"

namespace talus {

struct RunFolder {
  std::filesystem::path directory;
  nlohmann::json provenance, summary;  ///< of run.json; objects, empty where it has none
  nlohmann::json status;               ///< status.json
  std::string resolved;                ///< text of scene.resolved.toml
  std::optional<io::Scene> scene;      ///< none where the files that it names are gone
  io::TableColumns steps;              ///< what sections ask of steps.csv
};

/// The sentences under `key` of its summary, "warnings" or "findings"; what is no text there is left out.
std::vector<std::string> sentences_of(const RunFolder& run, const char* key);

/// The files of a run that pictures, pages and other formats are made from, which none of them may replace.
std::vector<std::filesystem::path> sources_in(const std::filesystem::path& directory);

/// Why the frames of results.h5 in a directory cannot be listed; "" where they can, or there is no such file.
std::string damage_of_frames(const std::filesystem::path& directory);

/// What scene.resolved.toml holds; none where it is not there, cannot be read, or the files that it names are
/// gone.
std::optional<io::Scene> resolved_scene(const std::filesystem::path& directory);

/// Throws std::invalid_argument where no run was begun, io::FileError where run.json or a table is not as
/// Talus wrote it, or the run has ended with other steps than steps.csv has.
RunFolder read_run_folder(const std::filesystem::path& directory);

}  // namespace talus
