#include "apps/commands/status.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/run_json_files.hpp"
#include "io/checkpoint/checkpoint_folder.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/results/run_json.hpp"

namespace talus {

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

/// A run holds its directory locked; where locks do not reach (another machine), its process and its
/// heartbeat tell. "alive", "dead" or "silent": nothing was heard for a minute, from another machine.
std::string life_of(const std::filesystem::path& directory, const json& beat) {
  constexpr double silence = 60;  // [s]
  try {
    const io::DirectoryLock lock(directory);
  } catch (const io::FileError&) {
    return "alive";
  }
  if (beat.value("host", "") == io::host_name()) return "dead";
  const double now =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  return now - beat.value("heartbeat", 0.0) < silence ? "alive" : "silent";
}

ordered_json status_of(const std::filesystem::path& directory) {
  const json run = read_run_json(directory), beat = read_status_json(directory);
  const json summary = run.value("summary", json::object());
  ordered_json status;
  std::string state = summary.value("status", "running");
  const bool ended = state != "running";
  if (!ended) {
    const std::string life = life_of(directory, beat);
    if (life != "alive") state = life;
  }
  status["state"] = state;
  status["step"] = ended ? summary.value("steps", std::int64_t{0}) : beat.value("step", std::int64_t{0});
  status["time"] = ended ? summary.value("time", 0.0) : beat.value("time", 0.0);
  status["missed_steps"] = ended ? summary.value("unconverged_steps", std::int64_t{0})
                                 : beat.value("missed_steps", std::int64_t{0});
  // A run that failed gave its last sign of life up to a second, or many steps, before.
  if (!ended || beat.value("step", std::int64_t{-1}) == status["step"])
    for (const char* key : {"stage", "stage_fraction"})
      if (beat.contains(key)) status[key] = beat[key];
  if (!ended)
    for (const char* key : {"pid", "host", "heartbeat"})
      if (beat.contains(key)) status[key] = beat[key];
  if (!ended && state != "dead")
    for (const char* key : {"steps_per_s", "stage_eta_s"})
      if (beat.contains(key)) status[key] = beat[key];
  if (ended) {
    status["exit_code"] = summary.value("exit_code", 0);
    status["message"] = summary.value("message", "");
  }
  const auto checkpoints = io::checkpoints_in(directory);
  if (!checkpoints.empty()) status["checkpoint"] = checkpoints.front().filename().string();
  return status;
}

std::string hours(double seconds) {
  const auto total = static_cast<std::int64_t>(std::ceil(seconds));
  return fmt::format("{}:{:02}:{:02}", total / 3600, total / 60 % 60, total % 60);
}

std::string sentence_of(const std::string& state) {
  if (state == "alive" || state == "running") return "running";
  if (state == "dead") return "dead: its process has ended and has not said how; --resume goes on";
  if (state == "silent") return "silent: nothing was heard from its machine for a minute";
  return state;
}

void print(const ordered_json& status) {
  std::string text = fmt::format("{}\n", sentence_of(status["state"].get<std::string>()));
  if (const std::string message = status.value("message", ""); !message.empty()) text += message + '\n';
  if (status.contains("stage"))
    text += fmt::format("stage '{}', {:.0f} % done\n", status["stage"].get<std::string>(),
                        100 * status.value("stage_fraction", 0.0));
  // Its last sign of life may be older than its last checkpoint.
  const bool lost = status["state"] == "dead" || status["state"] == "silent";
  text += fmt::format("{}step {}, {:.6g} s simulated, {} steps missed the tolerance\n",
                      lost ? "when last heard of: " : "", status["step"].get<std::int64_t>(),
                      status["time"].get<double>(), status["missed_steps"].get<std::int64_t>());
  if (status.contains("steps_per_s"))
    text += fmt::format("{:.3g} steps a second", status["steps_per_s"].get<double>()) +
            (status.contains("stage_eta_s")
                 ? fmt::format(", the stage takes {} more\n", hours(status["stage_eta_s"].get<double>()))
                 : "\n");
  text += status.contains("checkpoint")
              ? fmt::format("last checkpoint: {}\n", status["checkpoint"].get<std::string>())
              : "no checkpoint\n";
  print_out("{}", text);
}

}  // namespace

int status_command(const StatusOptions& options) {
  const std::filesystem::path directory = options.directory;
  if (!std::filesystem::exists(directory / "run.json") &&
      !std::filesystem::exists(directory / "status.json")) {
    print_error("talus: error: {}: no run was begun there\n", options.directory);
    return exit_bad_input;
  }
  try {
    const ordered_json status = status_of(directory);
    if (options.json)
      print_out("{}\n", status.dump(2, ' ', false, ordered_json::error_handler_t::replace));
    else
      print(status);
  } catch (const json::exception& error) {
    print_error("talus: error: {}\n", damaged_value(directory, error));
    return exit_bad_input;
  } catch (const io::FileError& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  return exit_done;
}

}  // namespace talus
