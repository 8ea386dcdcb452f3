#include "apps/commands/commands.hpp"
#include "apps/report/run_report.hpp"

namespace talus {

namespace {

void add_options(CLI::App& app, ReportOptions& options) {
  app.add_option("directory", options.directory, "directory of the results")->type_name("DIR")->required();
  app.add_option("-o,--out", options.out, "file [report.html in the directory]")->type_name("FILE");
  app.add_flag("--force", options.force, "replace a file of --out that is there");
}

int run(ReportOptions& options, CommandLine) {
  return report_command(options);
}

}  // namespace

Command report_entry() {
  return command<ReportOptions>("report", "write the page of a run, also while it goes on", add_options, run);
}

}  // namespace talus
