#include "apps/trace_command.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "apps/exit_codes.hpp"
#include "io/trace_file.hpp"
#include "runtime/trace/analysis.hpp"

namespace talus {

int trace_show_command(const TraceShowOptions& options) {
  try {
    const trace::Trace trace = io::read_trace(options.file);
    fmt::print("{}\n{}", options.file, trace::describe(trace::analyse(trace)));
  } catch (const std::exception& error) {
    fmt::print(stderr, "talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  return exit_done;
}

}  // namespace talus
