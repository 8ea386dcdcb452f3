#pragma once

/// When a run is written down, and what the command itself goes on from.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/run_messages.hpp"
#include "apps/shared/terminal.hpp"
#include "io/checkpoint/checkpoint_file.hpp"
#include "io/output/recorder.hpp"
#include "io/scene/scene.hpp"
#include "runtime/step/due_clock.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

/// What outlives a stop besides the simulation. Rank 0's counts.
struct RunMemory {
  Tally tally;
  std::int64_t frames_passed = 0;   ///< DueClock of frames
  std::int64_t saves_passed = 0;    ///< the same of checkpoints
  std::int64_t saved = 0;           ///< checkpoints so far that count for archive_every
  double wall_s = 0;                ///< elapsed [s]
  std::vector<double> wall_points;  ///< where the walls stood at first [m]
  double wall_mass = 0;             ///< of pushed walls to which the scene gives none [kg]
  std::vector<std::int64_t> named;  ///< ids of the bodies with names
  io::OutputMark mark;
};
std::string text_of(const RunMemory& memory);
/// `file` is named in errors. Throws io::FileError.
RunMemory read_memory(const std::string& text, const std::string& file);

/// The texts of a checkpoint: scene file, resolved scene, overrides, and the files that the scene reads.
/// `resolved`: as load_scene gave it, before its walls were placed. Throws io::FileError.
std::map<std::string, std::string> texts_of(const io::Scene& scene, const std::string& resolved,
                                            const std::vector<std::string>& overrides);
inline constexpr const char* resolved_text = "scene.resolved.toml";
inline constexpr const char* input_prefix = "input:";

/// Writes checkpoints, and removes old ones.
class CheckpointKeeper {
 public:
  /// References outlive it. `texts`: rank 0's.
  CheckpointKeeper(const io::CheckpointSpec& spec, std::filesystem::path directory,
                   std::map<std::string, std::string> texts, const graph::Communicator& ranks,
                   const Terminal& terminal);

  /// As of what a checkpoint remembers, or as of a new run; the clock of every_wall begins.
  void start(const RunMemory& memory);
  /// One is due by steps or simulated time: the same on all ranks, to be asked behind every step.
  bool due(const StepReport& report) { return due_.due(report.step, report.time); }
  /// By this rank's clock.
  bool wall_due(double now) const { return spec_.every_wall > 0 && now - last_save_ >= spec_.every_wall; }

  /// Collective, behind Simulation::begin_next_stage(). `memory`: but for what the keeper counts itself.
  /// False, on all ranks, when it could not be written: earlier ones are there still, and rank 0 says why.
  /// `counts`: for archive_every. One that is written only since the run ends here does not: where a run is
  /// stopped must not choose which states stay, where checkpoints go by steps or by time simulated.
  bool save(const Simulation& simulation, RunMemory memory, bool counts);

  std::optional<std::int64_t> last_step() const { return last_step_; }  ///< of the last checkpoint
  double last_save() const { return last_save_; }                       ///< clock then
  double seconds() const { return seconds_; }                           ///< that it took

 private:
  const io::CheckpointSpec& spec_;
  std::filesystem::path directory_;
  std::map<std::string, std::string> texts_;
  const graph::Communicator& ranks_;
  const Terminal& terminal_;
  DueClock due_;
  std::int64_t saved_ = 0;
  std::optional<std::int64_t> last_step_;
  double last_save_ = 0, seconds_ = 0;
};

}  // namespace talus
