#include "io/results/run_json.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/files/output_directory.hpp"
#include "io/results/build_info.hpp"
#include "io/results/version.hpp"

namespace talus::io {
namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

int allowed_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return ::sched_getaffinity(0, sizeof(set), &set) == 0 ? CPU_COUNT(&set) : 0;
}

/// The objects in a list of the provenance in a run.json; none where there is no such list.
std::vector<nlohmann::json> provenance_list(const std::filesystem::path& path, const char* name) {
  std::ifstream file(path);
  const nlohmann::json root = nlohmann::json::parse(file, nullptr, false);
  std::vector<nlohmann::json> objects;
  if (!root.is_object() || !root.contains("provenance")) return objects;
  const nlohmann::json& provenance = root["provenance"];
  if (!provenance.is_object() || !provenance.contains(name)) return objects;
  for (const nlohmann::json& entry : provenance[name])
    if (entry.is_object()) objects.push_back(entry);
  return objects;
}

/// What an object says by that name; `otherwise` where it says nothing, or something of another kind.
template <class T>
T said(const nlohmann::json& object, const char* name, T otherwise) {
  try {
    return object.value(name, otherwise);
  } catch (const nlohmann::json::exception&) {
    return otherwise;
  }
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

Provenance collect_provenance() {
  const BuildInfo build = build_info();
  Provenance p;
  p.version = version();
  p.git_hash = build.git_hash;
  p.git_dirty = build.git_dirty;
  p.compiler = build.compiler;
  p.flags = build.flags;
  p.build_type = build.build_type;
  p.host = host_name();
  p.cores_online = static_cast<int>(::sysconf(_SC_NPROCESSORS_ONLN));
  p.cores_allowed = allowed_cores();
  p.omp_proc_bind = environment("OMP_PROC_BIND");
  p.omp_places = environment("OMP_PLACES");
  p.date_utc = fmt::format(
      "{:%FT%TZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
  return p;
}

std::string run_json(const Provenance& p, const Summary& s) {
  // Ordered, so that people who open the file find things where they expect them.
  nlohmann::ordered_json root;
  root["provenance"] = {
      {"version", p.version},
      {"git_hash", p.git_hash},
      {"git_dirty", p.git_dirty},
      {"compiler", p.compiler},
      {"flags", p.flags},
      {"build_type", p.build_type},
      {"host", p.host},
      {"cores_online", p.cores_online},
      {"cores_allowed", p.cores_allowed},
      {"threads", p.threads},
      {"simd", p.simd},
      {"omp_proc_bind", p.omp_proc_bind},
      {"omp_places", p.omp_places},
      {"date_utc", p.date_utc},
      {"command_line", p.command_line},
      {"seed", p.seed},
      {"scene_file", p.scene_file},
  };
  for (const auto& [path, crc] : p.input_files)
    root["provenance"]["input_files"].push_back({{"path", path}, {"crc32", fmt::format("{:08x}", crc)}});
  for (const Resumption& resumed : p.resumed)
    root["provenance"]["resumed"].push_back({{"date_utc", resumed.date_utc},
                                             {"host", resumed.host},
                                             {"ranks", resumed.ranks},
                                             {"threads", resumed.threads},
                                             {"step", resumed.step},
                                             {"changes", resumed.changes}});
  nlohmann::ordered_json digest;  // null
  if (s.digest) digest = fmt::format("{:016x}", *s.digest);
  nlohmann::ordered_json sufficient;  // null
  if (s.sufficient_time_step) sufficient = *s.sufficient_time_step;
  nlohmann::ordered_json bodies_at_end;  // null
  if (s.bodies_at_end) bodies_at_end = *s.bodies_at_end;
  root["summary"] = {
      {"status", s.status},
      {"message", s.message},
      {"exit_code", s.exit_code},
      {"complete", s.complete},
      {"steps", s.steps},
      {"time", s.time},
      {"digest", digest},
      {"converged_steps", s.converged_steps},
      {"unconverged_steps", s.unconverged_steps},
      {"worst_error_rms", s.worst_error_rms},
      {"worst_balance", s.worst_balance},
      {"worst_velocity_error", s.worst_velocity_error},
      {"worst_penetration", s.worst_penetration},
      {"overlapping_steps", s.overlapping_steps},
      {"impossible_steps", s.impossible_steps},
      {"worst_overlap", s.worst_overlap},
      {"sufficient_time_step", sufficient},
      {"iterations", s.iterations},
      {"wall_s", s.wall_s},
      {"bodies", s.bodies},
      {"bodies_at_end", bodies_at_end},
      {"frames", s.frames},
      {"warnings", s.warnings},
      {"findings", s.findings},
  };
  // Names of files and hosts may be anything: bytes that are not UTF-8 are replaced, not a reason to lose the
  // run.
  return root.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

std::vector<Resumption> resumptions_in(const std::filesystem::path& path) {
  std::vector<Resumption> all;
  for (const nlohmann::json& entry : provenance_list(path, "resumed"))
    all.push_back({said(entry, "date_utc", std::string()), said(entry, "host", std::string()),
                   said(entry, "ranks", 1), said(entry, "threads", 1), said(entry, "step", std::int64_t{0}),
                   said(entry, "changes", std::vector<std::string>())});
  return all;
}

std::vector<InputFile> input_files_in(const std::filesystem::path& path) {
  std::vector<InputFile> all;
  for (const nlohmann::json& entry : provenance_list(path, "input_files"))
    all.push_back(
        {said(entry, "path", std::string()),
         static_cast<std::uint32_t>(std::strtoul(said(entry, "crc32", std::string()).c_str(), nullptr, 16))});
  return all;
}

void write_run_json(const std::filesystem::path& path, const Provenance& provenance, const Summary& summary) {
  write_whole_or_over(path, run_json(provenance, summary));
}

}  // namespace talus::io
