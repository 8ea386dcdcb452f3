#pragma once

#include <vector>

#include "apps/commands/command.hpp"

namespace talus {

/// The table of commands, in the order of `talus --help`.
std::vector<Command> commands();

/// The commands of the table, each from a file in entries/.
Command run_entry();
Command status_entry();
Command report_entry();
Command view_entry();
Command movie_entry();
Command convert_entry();
Command plan_entry();
Command partition_entry();
Command solve_entry();
Command trace_show_entry();
Command trace_export_entry();
Command replay_entry();
Command study_error_entry();
Command study_scaling_entry();
Command study_stability_entry();
Command study_certificate_entry();
Command validate_entry();
Command new_entry();
Command scene_reference_entry();
Command completion_entry();
Command man_entry();

}  // namespace talus
