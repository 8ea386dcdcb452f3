#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace talus {

struct TraceShowOptions {
  std::string file;
};

struct TraceExportOptions {
  std::string file;
  std::string format;                     ///< perfetto, paje or svg
  std::string out;                        ///< empty: the trace's name with another ending
  std::optional<std::uint32_t> step;      ///< one step only
  std::optional<std::int32_t> iteration;  ///< one epoch of that step's loop only
  bool force = false;                     ///< replace a file that is there
};

/// `talus trace show`: where the time of a trace went. Returns an ExitCode.
int trace_show_command(const TraceShowOptions& options);

/// `talus trace export`: the trace for Perfetto or ViTE, or as a picture. Returns an ExitCode.
int trace_export_command(const TraceExportOptions& options);

}  // namespace talus
