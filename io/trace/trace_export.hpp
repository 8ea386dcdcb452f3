#pragma once

/// Traces for the viewers of others.

#include <cstdint>
#include <optional>
#include <string>

#include "runtime/trace/timeline.hpp"

namespace talus::io {

/// What of a trace is shown: one step, and of its loop the epochs from one to another, or all.
struct TraceWindow {
  std::optional<std::uint32_t> step;
  std::optional<std::int32_t> epoch;  ///< needs a step
  bool shows(const trace::Record& record) const;
};

/// The trace as protocol buffers of Perfetto (ui.perfetto.dev; protos/perfetto/trace of its sources): a
/// process per rank, a track per thread, a slice per record, named by kind and subdomain, and arrows for
/// messages that somebody waited for. Some 32 bytes a record. `names` of tasks are interned per thread.
std::string to_perfetto(const trace::Trace& trace, const TraceWindow& window);

/// The trace as text in the format of Paje, for ViTE and pj_dump: a container per rank and thread, states,
/// and links for messages that somebody waited for. Some 130 bytes a record. Times in seconds.
std::string to_paje(const trace::Trace& trace, const TraceWindow& window);

/// "sweep, subdomain 3" or "cells".
std::string name_of(const trace::Trace& trace, const trace::Track& track, const trace::Record& record);

}  // namespace talus::io
