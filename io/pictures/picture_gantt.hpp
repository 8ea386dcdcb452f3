#pragma once

#include <string>

#include "io/trace/trace_export.hpp"
#include "runtime/trace/timeline.hpp"

namespace talus::io {

/// A trace over time: a row per thread, a bar per task coloured by phase, arrows for messages between ranks,
/// and the critical path as a line under the bars. Tasks narrower than half a pixel are merged with their
/// neighbours of the same phase, rows beyond 64 are left out, and the picture says so. The window must hold
/// one step at most. Throws trace::TraceError when it shows nothing.
std::string draw_gantt(const trace::Timeline& timeline, const TraceWindow& window);

}  // namespace talus::io
