/// Traces as text for ViTE and pj_dump (trace_export.hpp).

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "io/trace/detail/trace_events.hpp"

namespace talus::io {

namespace {

using trace::Record;

/// Event numbers are ours; what they mean stands in the head of the file.
constexpr const char* head = R"(%EventDef PajeDefineContainerType 0
%  Alias string
%  Type string
%  Name string
%EndEventDef
%EventDef PajeDefineStateType 1
%  Alias string
%  Type string
%  Name string
%EndEventDef
%EventDef PajeDefineLinkType 2
%  Alias string
%  Type string
%  StartContainerType string
%  EndContainerType string
%  Name string
%EndEventDef
%EventDef PajeDefineEntityValue 3
%  Alias string
%  Type string
%  Name string
%  Color color
%EndEventDef
%EventDef PajeCreateContainer 4
%  Time date
%  Alias string
%  Type string
%  Container string
%  Name string
%EndEventDef
%EventDef PajePushState 5
%  Time date
%  Type string
%  Container string
%  Value string
%EndEventDef
%EventDef PajePopState 6
%  Time date
%  Type string
%  Container string
%EndEventDef
%EventDef PajeStartLink 7
%  Time date
%  Type string
%  Container string
%  Value string
%  StartContainer string
%  Key string
%EndEventDef
%EventDef PajeEndLink 8
%  Time date
%  Type string
%  Container string
%  Value string
%  EndContainer string
%  Key string
%EndEventDef
0 run 0 run
0 rank run rank
0 thread rank thread
1 task thread task
2 message run thread thread message
)";

struct Happening {
  double time;
  std::string text;
};

/// A line for each begin, end and link, in order of time, as the format wants them.
std::vector<Happening> happenings_of(const trace::Trace& trace, const TraceWindow& window) {
  std::vector<Happening> happenings;
  const std::unordered_map<const Record*, std::size_t> links = detail::links_of(trace, window);
  const auto link = [&](char event, double time, const std::string& here, const Record& r) {
    if (const auto found = links.find(&r); found != links.end())
      happenings.push_back(
          {time, fmt::format("{} {:.9f} message all m {} {}", event, time, here, found->second)});
  };
  const auto start = static_cast<double>(detail::first_begin(trace, window));
  for (const trace::Track& track : trace.tracks) {
    const std::string here = fmt::format("r{}t{}", track.rank, track.thread);
    const auto begin = [&](const Record& r) {
      const double time = 1e-9 * (static_cast<double>(r.begin) - start);
      if (r.kind() == trace::kind_send) link('7', time, here, r);
      happenings.push_back(
          {time, fmt::format("5 {:.9f} task {} k{}", time, here, static_cast<int>(r.kind()))});
    };
    const auto end = [&](const Record& r) {
      const double time = 1e-9 * (r.end() - start);
      happenings.push_back({time, fmt::format("6 {:.9f} task {}", time, here)});
      if (r.kind() == trace::kind_receive) link('8', time, here, r);
    };
    detail::in_order(track, window, begin, end);
  }
  std::stable_sort(happenings.begin(), happenings.end(),
                   [](const Happening& a, const Happening& b) { return a.time < b.time; });
  return happenings;
}

}  // namespace

std::string to_paje(const trace::Trace& trace, const TraceWindow& window) {
  std::string out = head;
  const auto line = [&out]<class... T>(fmt::format_string<T...> format, T&&... values) {
    fmt::format_to(std::back_inserter(out), format, std::forward<T>(values)...);
    out += '\n';
  };
  static constexpr const char* colours[] = {"0.6 0.4 0.8", "0.3 0.6 0.9", "0.2 0.7 0.3", "0.9 0.5 0.1",
                                            "0.5 0.5 0.2", "0.9 0.9 0.9", "0.7 0.7 0.7"};
  for (std::size_t k = 0; k < trace.kinds.size(); ++k)
    line("3 k{} task \"{}\" \"{}\"", k, trace.kinds[k].name,
         colours[static_cast<std::size_t>(trace.kinds[k].phase)]);
  line("4 0 all run 0 \"{}\"", trace.predicted ? "predicted" : "recorded");
  for (std::int32_t rank = 0; rank < trace.ranks; ++rank) line("4 0 r{0} rank all \"rank {0}\"", rank);
  for (const trace::Track& track : trace.tracks)
    line("4 0 r{0}t{1} thread r{0} \"thread {1}\"", track.rank, track.thread);

  for (const Happening& happening : happenings_of(trace, window)) line("{}", happening.text);
  return out;
}

}  // namespace talus::io
