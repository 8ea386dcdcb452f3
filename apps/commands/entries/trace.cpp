#include "apps/commands/commands.hpp"

#include "apps/commands/trace_command.hpp"

namespace talus {

namespace {

void add_show_options(CLI::App& app, TraceShowOptions& options) {
  app.add_option("file", options.file, "trace.h5 of a run")->type_name("FILE")->required();
}

void add_export_options(CLI::App& app, TraceExportOptions& options) {
  app.add_option("file", options.file, "trace.h5 of a run")->type_name("FILE")->required();
  app.add_option("--format", options.format, "perfetto, paje or svg")->required();
  app.add_option("--step", options.step, "this step only [svg: the middle one]");
  app.add_option("--iteration", options.iteration, "this iteration of the step only");
  app.add_option("-o,--out", options.out, "file [the trace's name, .pftrace, .paje or .svg]")
      ->type_name("FILE");
  app.add_flag("--force", options.force, "replace the file where it is there");
}

}  // namespace

Command trace_show_entry() {
  return command<TraceShowOptions>(
      "show", "say where the time went", add_show_options,
      [](TraceShowOptions& options, CommandLine) { return trace_show_command(options); });
}

Command trace_export_entry() {
  return command<TraceExportOptions>(
      "export", "write it for Perfetto or ViTE, or as a picture", add_export_options,
      [](TraceExportOptions& options, CommandLine) { return trace_export_command(options); });
}

}  // namespace talus
