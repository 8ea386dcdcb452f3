#include "apps/commands/commands.hpp"

#include "apps/study_error/study_error.hpp"

namespace talus {

Command study_error_entry() {
  return command<StudyErrorOptions>(
      "error", "error against run time: of one step, of whole runs, or a performance profile of FCLIB files",
      add_study_error_options,
      [](StudyErrorOptions& options, CommandLine) { return study_error_command(options); });
}

}  // namespace talus
