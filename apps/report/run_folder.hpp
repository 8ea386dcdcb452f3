#pragma once

/// The directory of a run as a page needs it.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

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

/// Throws std::invalid_argument where no run was begun, io::FileError where a table is not as Talus wrote it.
RunFolder read_run_folder(const std::filesystem::path& directory);

}  // namespace talus
