#include "io/trace/detail/trace_events.hpp"

#include <algorithm>
#include <limits>

namespace talus::io::detail {

using trace::Record;

std::int64_t first_begin(const trace::Trace& trace, const TraceWindow& window) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  for (const trace::Track& track : trace.tracks)
    for (const Record& record : track.records)
      if (window.shows(record)) first = std::min(first, record.begin);
  return first;
}

std::unordered_map<const Record*, std::size_t> links_of(const trace::Trace& trace,
                                                        const TraceWindow& window) {
  const auto sends = trace::sends_of(trace);
  std::unordered_map<const Record*, std::size_t> links;
  std::size_t count = 0;
  for (const trace::Track& track : trace.tracks)
    for (const Record& record : track.records)
      if (const auto sent = sends.find(&record); sent != sends.end() && window.shows(record))
        links[&record] = links[sent->second] = ++count;
  return links;
}

}  // namespace talus::io::detail
