#include "apps/commands/run_resume.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "apps/report/run_folder.hpp"
#include "io/checkpoint/checkpoint_folder.hpp"
#include "io/files/crc.hpp"
#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/results/results.hpp"
#include "io/results/run_json.hpp"
#include "runtime/step/decomposition.hpp"

namespace talus {

namespace {

/// Names of the files, the latest first, as rank 0 finds them: another rank may see a younger state of a
/// shared folder.
std::vector<std::filesystem::path> agreed_files(const std::filesystem::path& directory,
                                                const graph::Communicator& ranks) {
  std::string names;
  if (ranks.rank() == 0)
    for (const std::filesystem::path& path : io::checkpoints_in(directory))
      names += path.filename().string() + '\n';
  const std::vector<char> all = ranks.gather_records(std::span<const char>(names));
  std::istringstream lines(std::string(all.begin(), all.end()));
  std::vector<std::filesystem::path> paths;
  for (std::string name; std::getline(lines, name);) paths.push_back(directory / name);
  return paths;
}

std::optional<ResumePoint> read_point(const std::filesystem::path& path, const io::Scene& scene,
                                      const graph::Communicator& ranks) {
  ResumePoint point{path, io::read_checkpoint_head(path), {}, {}};
  point.memory = read_memory(point.file.run, path.string());
  const int subdomains = point.file.state.head.subdomains;
  const Decomposition all = make_decomposition(with_subdomains(scene.setup.decomposition, subdomains), ranks);
  for (const SubdomainId e : all.here) point.file.state.here.push_back(e.value());
  point.file.state.parts = io::read_checkpoint_parts(path, point.file.state.here);
  return point;
}

/// Whether a sink that is asked for writes the file.
bool goes_on(const std::string& file, const io::OutputSpec& output) {
  return std::ranges::any_of(io::sink_registry(), [&](const auto& sink) {
    return sink.make->writes(file) &&
           (sink.make->use == io::SinkUse::always || output.sinks.contains(std::string(sink.name)));
  });
}

/// Of a directory without scene.resolved.toml: throws naming a result of which nothing says whose it is.
void demand_no_results(const std::filesystem::path& directory) {
  for (const std::filesystem::path& path : io::outputs_in(directory, io::is_output_name)) {
    const std::string whole = io::whole_name(path.string());
    if (whole == "run.log" || whole == resolved_text) continue;
    throw std::invalid_argument(fmt::format(
        "{}: no {} beside it says of which scene it is, and --resume would replace it. Begin a run in "
        "another directory, or give --force in place of --resume",
        (directory / path).string(), resolved_text));
  }
}

std::vector<io::SceneChange> changes_since(const std::filesystem::path& resolved, const std::string& then,
                                           const io::Scene& scene) {
  try {
    return io::scene_changes(then, io::resolved_scene(scene));
  } catch (const std::exception& error) {
    throw std::invalid_argument(fmt::format("{}: {}, so that nobody knows of which scene the run there was",
                                            resolved.string(), error.what()));
  }
}

/// Nothing of a file that cannot be read.
std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Whether a key names an input file that stands elsewhere now and holds the same: a folder that was moved.
bool only_moved(const io::SceneChange& change, const io::Scene& scene, const ResumePoint& point) {
  const auto unquoted = [](const std::string& text) {
    return text.size() >= 2 ? text.substr(1, text.size() - 2) : text;
  };
  const std::string file = unquoted(change.is);
  const std::vector<std::string> inputs = io::input_files(scene);
  const auto then = point.file.texts.find(input_prefix + unquoted(change.was));
  return then != point.file.texts.end() && std::ranges::find(inputs, file) != inputs.end() &&
         bytes_of(file) == then->second;
}

}  // namespace

std::optional<ResumePoint> find_resume_point(const std::filesystem::path& directory, const io::Scene& scene,
                                             const graph::Communicator& ranks, const Terminal& terminal) {
  const std::vector<std::filesystem::path> files = agreed_files(directory, ranks);
  std::string why;
  for (const std::filesystem::path& path : files) {
    std::optional<ResumePoint> point;
    try {
      point = read_point(path, scene, ranks);
    } catch (const std::exception& error) {
      why = error.what();
    }
    double failed[1] = {point ? 0.0 : 1.0};
    ranks.max(failed);
    if (failed[0] == 0) return point;
    if (why.empty()) why = path.string() + ": another rank could not read its part";
    if (ranks.rank() == 0) terminal.warn("warning: {}", why);
  }
  if (!files.empty())
    throw std::invalid_argument(fmt::format(
        "no checkpoint in {} can be gone on from; the last was refused with: {}", directory.string(), why));
  return std::nullopt;
}

void compare_scenes(const io::Scene& scene, const std::string& resolved, ResumePoint& point) {
  const auto text = [&](const std::string& name) -> const std::string& {
    const auto found = point.file.texts.find(name);
    if (found == point.file.texts.end())
      throw std::invalid_argument(fmt::format("{} holds no '{}'", point.path.string(), name));
    return found->second;
  };
  point.changes = io::scene_changes(text(resolved_text), resolved);
  std::vector<std::string> refused;
  for (const io::SceneChange& change : point.changes)
    if (!change.allowed && !only_moved(change, scene, point)) refused.push_back(io::describe(change));
  for (const std::string& file : io::input_files(scene)) {
    const auto known = point.file.texts.find(input_prefix + file);
    if (known == point.file.texts.end()) continue;  // a change of a key
    if (bytes_of(file) != known->second) refused.push_back(file + " has changed");
  }
  if (refused.empty()) return;
  constexpr std::size_t most_named = 8;
  if (const std::size_t all = refused.size(); all > most_named) {
    refused.resize(most_named);
    refused.push_back(fmt::format("and {} more", all - most_named));
  }
  throw std::invalid_argument(fmt::format(
      "the checkpoint {} is of another scene: {}. Ends of stages, loads of walls, output and checkpoints "
      "may change; for anything else, stresses of a cell among it, begin a run in another directory, from "
      "this state if you like ([sample] kind = \"state\")",
      point.path.string(), fmt::join(refused, "; ")));
}

void demand_files_of_run(const std::filesystem::path& directory, const io::OutputSpec& output,
                         const io::OutputMark& mark, bool mends) {
  const auto refuse = [&](const std::string& name, const std::string& what) {
    throw std::invalid_argument(fmt::format(
        "{}: {}. Put the file back, or begin a run in another directory, from this state if you like "
        "([sample] kind = \"state\")",
        (directory / name).string(), what));
  };
  const auto demand_file = [&](const std::string& name) {
    const std::filesystem::path path = directory / name;
    std::error_code unknown;
    if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(path, unknown)))
      refuse(name, "the run would go on in this file, and there is none");
    if (::access(path.c_str(), W_OK) != 0)
      refuse(name, "the run would go on in this file, and may not write it");
  };
  for (const auto& [name, known] : mark.files) {
    if (!goes_on(name, output)) continue;
    demand_file(name);
    if (io::crc_of_file(directory / name, known.bytes) != known.crc)
      refuse(name,
             fmt::format("the run wrote {} bytes until the checkpoint, and these are others", known.bytes));
  }
  const std::string results = "results.h5";
  if (!goes_on(results, output)) return;
  demand_file(results);
  if (mends) io::demand_kept_frames(directory / results, mark.frame_times.size());
}

std::string fault_of_results(const std::filesystem::path& directory, const io::OutputSpec& output) {
  const std::filesystem::path results = directory / "results.h5";
  std::error_code unknown;
  if (!goes_on(results.filename().string(), output)) return "";
  if (!std::filesystem::exists(results, unknown)) return results.string() + ": is missing";
  return damage_of_frames(directory);
}

void demand_results_of_scene(const std::filesystem::path& directory, const io::Scene& scene, bool done) {
  const std::filesystem::path resolved = directory / resolved_text, run_json = directory / "run.json";
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(resolved, unknown) && !done) return demand_no_results(directory);
  std::ifstream json(run_json);
  const std::string then = bytes_of(resolved);
  const auto unread = [&](const std::filesystem::path& path) {
    return std::invalid_argument(path.string() +
                                 ": cannot be read, so that nobody knows of which scene the run there was. "
                                 "Begin a run in another directory");
  };
  if (then.empty()) throw unread(resolved);
  if (std::filesystem::exists(run_json, unknown) && !nlohmann::json::parse(json, nullptr, false).is_object())
    throw unread(run_json);
  std::vector<std::string> differences;
  for (const io::SceneChange& change : changes_since(resolved, then, scene)) {
    // A run that went on wrote how many it had.
    const bool chosen = change.key == "decomposition.subdomains" && change.is.empty();
    if (!chosen && (done || !change.allowed)) differences.push_back(io::describe(change));
  }
  const std::vector<std::string> inputs = io::input_files(scene);
  for (const auto& [path, crc] : io::input_files_in(run_json))
    if (std::ranges::find(inputs, path) != inputs.end() && io::crc_of_file(path) != crc)
      differences.push_back(path + " has changed");
  if (differences.empty()) return;
  throw std::invalid_argument(fmt::format(
      "the run in {} left no checkpoint to go on from, and was of another scene: {}. Begin a run in another "
      "directory, or replace its results by --force in place of --resume",
      directory.string(), fmt::join(differences, "; ")));
}

bool has_ends_of(const std::filesystem::path& directory, const io::Scene& scene) {
  const std::string then = bytes_of(directory / resolved_text);
  if (then.empty()) return true;
  try {
    return std::ranges::none_of(changes_since(directory / resolved_text, then, scene), io::moves_an_end);
  } catch (const std::invalid_argument&) {
    return true;
  }
}

void take_over(const ResumePoint& point, io::Scene& scene) {
  DecompositionSettings& decomposition = scene.setup.decomposition;
  if (decomposition.subdomains == 0)
    decomposition = with_subdomains(decomposition, point.file.state.head.subdomains);
  io::place_walls_again(scene, {point.memory.wall_points, point.memory.wall_mass, point.memory.named});
}

EarlierRun earlier_run(const std::filesystem::path& directory) {
  EarlierRun run;
  std::ifstream file(directory / "run.json");
  const nlohmann::json read = nlohmann::json::parse(file, nullptr, false);
  if (!read.is_object() || !read.contains("summary") || !read["summary"].is_object()) return run;
  const nlohmann::json& summary = read["summary"];
  if (const auto complete = summary.find("complete"); complete != summary.end() && complete->is_boolean())
    run.complete = complete->get<bool>();
  if (const auto status = summary.find("status"); status != summary.end()) run.done = *status == "done";
  if (const auto code = summary.find("exit_code"); code != summary.end() && code->is_number_integer())
    run.exit_code = code->get<int>();
  if (const auto warnings = summary.find("warnings"); warnings != summary.end() && warnings->is_array())
    for (const nlohmann::json& warning : *warnings)
      if (warning.is_string()) run.warnings.push_back(warning.get<std::string>());
  return run;
}

}  // namespace talus
