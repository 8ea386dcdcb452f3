#pragma once

/// run.json: where a run's numbers come from, and what came of it (keys: docs/formats.md).

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace talus::io {

/// A run went on from a checkpoint.
struct Resumption {
  std::string date_utc, host;
  int ranks = 1, threads = 1;
  std::int64_t step = 0;             ///< behind which it went on
  std::vector<std::string> changes;  ///< of the scene since the checkpoint, as sentences
};

/// A file that the scene reads, as it was.
struct InputFile {
  std::string path;
  std::uint32_t crc = 0;  ///< crc_of_file
};

/// Everything that is needed to repeat a run, or to understand why a repetition differs.
struct Provenance {
  std::string version;     ///< release of Talus
  std::string git_hash;    ///< commit that was built, "unknown" outside a git checkout
  bool git_dirty = false;  ///< true: the sources had changes that are in no commit
  std::string compiler;    ///< name and version
  std::string flags;
  std::string build_type;
  std::string host;
  int cores_online = 0;       ///< of the machine
  int cores_allowed = 0;      ///< in the affinity mask of the process at its start
  int threads = 0;            ///< that compute
  std::string simd;           ///< instructions of the sweeps: "portable", "avx2" or "avx512"
  std::string omp_proc_bind;  ///< environment variable, "" when unset
  std::string omp_places;     ///< environment variable, "" when unset
  std::string date_utc;       ///< start, ISO 8601, e.g. 2024-05-31T12:00:00Z
  std::vector<std::string> command_line;
  std::uint64_t seed = 0;
  std::string scene_file;
  std::vector<InputFile> input_files = {};  ///< that the scene reads
  std::vector<Resumption> resumed = {};     ///< in their order
};

/// Of this machine; "unknown" where the system does not say.
std::string host_name();

/// What is known of the build and of the machine now. The fields from `threads` on that describe the run,
/// apart from the environment and the date, are for the caller to fill. Call it before threads are pinned:
/// they narrow the affinity mask.
Provenance collect_provenance();

/// What came of the run.
struct Summary {
  std::string status = "running";  ///< "running", "done", "failed" or "stopped"
  std::string message;             ///< why it failed or stopped, or what was left undone
  int exit_code = 0;
  bool complete = false;  ///< the last stage has ended
  std::int64_t steps = 0;
  double time = 0;                      ///< [s] simulated
  std::optional<std::uint64_t> digest;  ///< talus::digest of the final state, as 16 hexadecimal digits
  std::int64_t converged_steps = 0;
  std::int64_t unconverged_steps = 0;
  double worst_error_rms = 0;                  ///< over all steps
  double worst_balance = 0;                    ///< over all steps
  double worst_velocity_error = 0;             ///< over the certified steps
  double worst_penetration = 0;                ///< over all steps, in smallest radii
  std::int64_t overlapping_steps = 0;          ///< that ended with an overlap beyond its tolerance
  std::int64_t impossible_steps = 0;           ///< that missed as walls close on grains which cannot get away
  double worst_overlap = 0;                    ///< over all steps, in smaller radii of a pair
  std::optional<double> sufficient_time_step;  ///< [s] that would have kept them within it
  std::int64_t iterations = 0;                 ///< over all steps
  double wall_s = 0;                           ///< elapsed [s]
  std::size_t bodies = 0;                      ///< with which it began
  std::optional<std::size_t> bodies_at_end;    ///< with those that came, without those that went; once known
  std::vector<std::string> warnings = {};      ///< of the scene, said when the run began
  std::vector<std::string> findings = {};      ///< of its steps, said at its end
  std::size_t frames = 0;                      ///< output times
};

/// The text of run.json. Without a digest, as long as it runs and when it failed, that is null; so are
/// numbers that are not finite.
std::string run_json(const Provenance& provenance, const Summary& summary);

/// Those that a run.json names; none where there is no such file, or it is damaged.
std::vector<Resumption> resumptions_in(const std::filesystem::path& path);
std::vector<InputFile> input_files_in(const std::filesystem::path& path);

/// Writes run.json whole (write_whole). Throws FileError.
void write_run_json(const std::filesystem::path& path, const Provenance& provenance, const Summary& summary);

}  // namespace talus::io
