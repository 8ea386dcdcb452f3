#pragma once

/// The records of a trace as events in time, as the formats of viewers want them.

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "io/trace/trace_export.hpp"

namespace talus::io::detail {

/// When the first record that the window shows began [ns]; the largest number where it shows none.
std::int64_t first_begin(const trace::Trace& trace, const TraceWindow& window);

/// Numbers the messages that somebody waited for, by their records at both ends. Others have no end that is
/// known, which the formats want.
std::unordered_map<const trace::Record*, std::size_t> links_of(const trace::Trace& trace,
                                                               const TraceWindow& window);

/// Calls `begin(record)` and `end(record)` in order of time, spans inside tasks nested.
template <class Begin, class End>
void in_order(const trace::Track& track, const TraceWindow& window, Begin begin, End end) {
  std::vector<const trace::Record*> open;
  for (const trace::Record& record : track.records) {
    if (!window.shows(record)) continue;
    while (!open.empty() && open.back()->end() <= static_cast<double>(record.begin)) {
      end(*open.back());
      open.pop_back();
    }
    begin(record);
    open.push_back(&record);
  }
  for (; !open.empty(); open.pop_back()) end(*open.back());
}

}  // namespace talus::io::detail
