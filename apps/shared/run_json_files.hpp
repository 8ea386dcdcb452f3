#pragma once

/// run.json and status.json of a run, as readers of results need them.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace talus {

/// run.json in the directory of a run; an empty object where it has none yet. Throws io::FileError where it
/// holds no object of JSON, or its `provenance` or `summary` is none: the program replaces the file as a
/// whole, so that no reader meets half of it.
nlohmann::json read_run_json(const std::filesystem::path& directory);

/// status.json, likewise; empty also where it is damaged, since on a full disk it is written in place.
nlohmann::json read_status_json(const std::filesystem::path& directory);

/// What to say where a value of these files is of another type than the program writes.
std::string damaged_value(const std::filesystem::path& directory, const nlohmann::json::exception& error);

}  // namespace talus
