#include "apps/commands/commands.hpp"

#include "apps/study_scaling/study_scaling.hpp"

namespace talus {

Command study_scaling_entry() {
  return command<StudyScalingOptions>(
      "scaling", "strong and weak scaling: runs on this machine, predictions for larger ones",
      add_study_scaling_options,
      [](StudyScalingOptions& options, CommandLine) { return study_scaling_command(options); });
}

}  // namespace talus
