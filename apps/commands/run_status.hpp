#pragma once

/// status.json: how far a run is, for `talus status` in another terminal.

#include <filesystem>
#include <optional>
#include <string>

#include "apps/commands/run_checkpoints.hpp"
#include "apps/commands/run_messages.hpp"
#include "runtime/step/simulation.hpp"

namespace talus {

/// Written by rank 0: at the start, then at most once a second behind a step, and behind the last one. What
/// cannot be written is left out: a run does not end for that.
class StatusFile {
 public:
  explicit StatusFile(const std::filesystem::path& directory);

  /// Before the first step: the sample is being made, or read.
  void begin() const;
  /// `now`: clock (graph::seconds_now). `last`: the run ends behind this step.
  void update(const Simulation& simulation, const Tally& tally, const CheckpointKeeper& keeper, double now,
              bool last);

 private:
  std::filesystem::path path_;
  double written_ = -1e9;                        ///< clock
  std::string stage_;                            ///< of the last update
  double stage_began_ = 0, stage_fraction_ = 0;  ///< clock and fraction at its first update
  std::optional<std::int64_t> first_step_;
  double first_time_ = 0;  ///< clock
};

}  // namespace talus
