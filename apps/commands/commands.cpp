#include "apps/commands/commands.hpp"

namespace talus {

std::vector<Command> commands() {
  return {
      new_entry(),
      run_entry(),
      status_entry(),
      report_entry(),
      view_entry(),
      movie_entry(),
      convert_entry(),
      plan_entry(),
      partition_entry(),
      solve_entry(),
      {.name = "trace",
       .sentence = "look at what `talus run --trace` recorded",
       .subcommands = {trace_show_entry(), trace_export_entry()}},
      replay_entry(),
      {.name = "study",
       .sentence = "measure how well and how fast scenes are solved",
       .subcommands = {study_error_entry(), study_scaling_entry(), study_stability_entry(),
                       study_certificate_entry()}},
      validate_entry(),
      scene_reference_entry(),
      completion_entry(),
      man_entry(),
  };
}

}  // namespace talus
