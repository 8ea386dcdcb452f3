#include "apps/commands/trace_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "io/files/output_directory.hpp"
#include "io/pictures/picture_gantt.hpp"
#include "io/trace/trace_export.hpp"
#include "io/trace/trace_file.hpp"
#include "runtime/trace/analysis.hpp"

namespace talus {

int trace_show_command(const TraceShowOptions& options) {
  try {
    const trace::Trace trace = io::read_trace(options.file);
    print_out("{}\n{}", options.file, trace::describe(trace::analyse(trace)));
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  return exit_done;
}

namespace {

/// The picture of one step: the middle one when none was named, since a picture of all shows nothing.
std::uint32_t step_to_draw(const trace::Timeline& timeline, const TraceExportOptions& options) {
  const auto& steps = timeline.steps();
  if (!options.step) return steps[steps.size() / 2];
  if (std::find(steps.begin(), steps.end(), *options.step) == steps.end())
    throw std::invalid_argument(fmt::format("{} has no step {}: it holds {} to {}", options.file,
                                            *options.step, steps.front(), steps.back()));
  return *options.step;
}

}  // namespace

int trace_export_command(const TraceExportOptions& options) {
  std::string out, content;
  try {
    static const std::map<std::string, std::string> endings{
        {"perfetto", ".pftrace"}, {"paje", ".paje"}, {"svg", ".svg"}};
    const auto ending = endings.find(options.format);
    if (ending == endings.end())
      throw std::invalid_argument(
          fmt::format("there is no format '{}': perfetto, paje or svg", options.format));
    out = options.out.empty() ? std::filesystem::path(options.file).replace_extension(ending->second).string()
                              : options.out;
    io::check_output_files({options.file}, {out}, options.force);
    const trace::Trace trace = io::read_trace(options.file);
    const trace::Timeline timeline(trace);
    io::TraceWindow window{options.step, options.iteration};
    if (options.step || options.iteration || options.format == "svg")
      window.step = step_to_draw(timeline, options);
    content = options.format == "perfetto" ? io::to_perfetto(trace, window)
              : options.format == "paje"   ? io::to_paje(trace, window)
                                           : io::draw_gantt(timeline, window);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    io::write_whole(out, content);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
  print_error("talus: {} written\n", out);
  return exit_done;
}

}  // namespace talus
