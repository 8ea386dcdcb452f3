#include "io/trace/trace_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <unordered_map>
#include <utility>

namespace talus::io {
namespace {

using trace::Record;

/// A message of protocol buffers in the making.
class Message {
 public:
  void varint(std::uint32_t field, std::uint64_t value) {
    number(std::uint64_t{field} << 3);
    number(value);
  }
  void fixed64(std::uint32_t field, std::uint64_t value) {
    number(std::uint64_t{field} << 3 | 1);
    for (int shift = 0; shift < 64; shift += 8) text_ += static_cast<char>(value >> shift & 0xff);
  }
  void text(std::uint32_t field, const std::string& value) {
    number(std::uint64_t{field} << 3 | 2);
    number(value.size());
    text_ += value;
  }
  void message(std::uint32_t field, const Message& value) { text(field, value.text_); }
  const std::string& bytes() const { return text_; }

 private:
  void number(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) text_ += static_cast<char>((value & 0x7f) | 0x80);
    text_ += static_cast<char>(value);
  }
  std::string text_;
};

/// Fields of Perfetto's messages, by their names there.
namespace field {
constexpr std::uint32_t packet = 1;
constexpr std::uint32_t timestamp = 8, sequence_id = 10, track_event = 11, interned_data = 12,
                        sequence_flags = 13, packet_defaults = 59, track_descriptor = 60;
constexpr std::uint32_t descriptor_uuid = 1, descriptor_process = 3, descriptor_thread = 4,
                        descriptor_parent = 5;
constexpr std::uint32_t process_pid = 1, process_name = 6, thread_pid = 1, thread_tid = 2, thread_name = 5;
constexpr std::uint32_t event_type = 9, event_name_iid = 10, event_track = 11, event_flows = 47,
                        event_last_flows = 48;
constexpr std::uint32_t event_names = 2, name_iid = 1, name_name = 2, default_event = 11;
}  // namespace field
constexpr std::uint64_t slice_begin = 1, slice_end = 2;
constexpr std::uint64_t state_cleared = 1, needs_state = 2;

/// Names of the records of one track, with a look at the plan per step only.
class Namer {
 public:
  Namer(const trace::Trace& trace, const trace::Track& track) : trace_(trace), track_(track) {}
  std::string operator()(const Record& record) {
    if (!known_ || step_ != record.step()) {
      step_ = record.step();
      plan_ = trace::plan_of(trace_, track_.rank, step_);
      known_ = true;
    }
    const std::string& kind = trace_.info(record.kind()).name;
    if (record.kind() == trace::kind_send || record.kind() == trace::kind_receive) {
      const auto end = [](std::uint32_t group) {
        return group == trace::root_group ? std::string("root") : fmt::format("{}", group);
      };
      return fmt::format("{} {} to {}", kind, end(record.node >> 16), end(record.node & 0xffffU));
    }
    if (record.epoch < 0 || record.kind() == trace::kind_check || record.kind() == trace::kind_collective ||
        !plan_ || record.node >= plan_->size() || plan_->group[record.node] == trace::root_group)
      return kind;
    return fmt::format("{}, subdomain {}", kind, plan_->group[record.node]);
  }

 private:
  const trace::Trace& trace_;
  const trace::Track& track_;
  const trace::Plan* plan_ = nullptr;
  std::uint32_t step_ = 0;
  bool known_ = false;
};

std::int64_t first_begin(const trace::Trace& trace, const TraceWindow& window) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  for (const trace::Track& track : trace.tracks)
    for (const Record& record : track.records)
      if (window.shows(record)) first = std::min(first, record.begin);
  return first;
}

/// Calls `begin(record)` and `end(record)` in order of time, spans inside tasks nested.
template <class Begin, class End>
void in_order(const trace::Track& track, const TraceWindow& window, Begin begin, End end) {
  std::vector<const Record*> open;
  for (const Record& record : track.records) {
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

/// Numbers the messages that somebody waited for, by their records at both ends. Others have no end that is
/// known, which the formats want.
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

}  // namespace

bool TraceWindow::shows(const Record& record) const {
  if (step && record.step() != *step) return false;
  return !epoch || record.epoch == *epoch;
}

std::string name_of(const trace::Trace& trace, const trace::Track& track, const Record& record) {
  return Namer(trace, track)(record);
}

std::string to_perfetto(const trace::Trace& trace, const TraceWindow& window) {
  std::string out;
  const auto add = [&out](const Message& packet) {
    Message whole;
    whole.message(field::packet, packet);
    out += whole.bytes();
  };
  const auto rank_uuid = [](std::int32_t rank) {
    return std::uint64_t{1} << 32 | static_cast<std::uint32_t>(rank);
  };
  for (std::int32_t rank = 0; rank < trace.ranks; ++rank) {
    Message process, descriptor, packet;
    process.varint(field::process_pid, static_cast<std::uint64_t>(rank) + 1);
    process.text(field::process_name, fmt::format("rank {}{}", rank, trace.predicted ? " (predicted)" : ""));
    descriptor.varint(field::descriptor_uuid, rank_uuid(rank));
    descriptor.message(field::descriptor_process, process);
    packet.message(field::track_descriptor, descriptor);
    add(packet);
  }
  const std::int64_t start = first_begin(trace, window);
  const std::unordered_map<const Record*, std::size_t> links = links_of(trace, window);
  for (std::size_t k = 0; k < trace.tracks.size(); ++k) {
    const trace::Track& track = trace.tracks[k];
    const std::uint64_t uuid = std::uint64_t{2} << 32 | k, sequence = k + 1;
    Message thread, descriptor, defaults, event_defaults, packet;
    thread.varint(field::thread_pid, static_cast<std::uint64_t>(track.rank) + 1);
    thread.varint(field::thread_tid, static_cast<std::uint64_t>(k) + 1);
    thread.text(field::thread_name, fmt::format("thread {}", track.thread));
    descriptor.varint(field::descriptor_uuid, uuid);
    descriptor.varint(field::descriptor_parent, rank_uuid(track.rank));
    descriptor.message(field::descriptor_thread, thread);
    event_defaults.varint(field::event_track, uuid);
    defaults.message(field::default_event, event_defaults);
    packet.varint(field::sequence_id, sequence);
    packet.varint(field::sequence_flags, state_cleared);
    packet.message(field::track_descriptor, descriptor);
    packet.message(field::packet_defaults, defaults);
    add(packet);

    Namer name(trace, track);
    std::unordered_map<std::string, std::uint64_t> names;
    const auto slice = [&](const Record& record, bool begins) {
      Message event, made;
      event.varint(field::event_type, begins ? slice_begin : slice_end);
      const double time =
          begins ? static_cast<double>(record.begin - start) : record.end() - static_cast<double>(start);
      made.varint(field::timestamp, static_cast<std::uint64_t>(std::llround(time)));
      made.varint(field::sequence_id, sequence);
      made.varint(field::sequence_flags, needs_state);
      if (begins) {
        const auto [found, fresh] = names.try_emplace(name(record), names.size() + 1);
        event.varint(field::event_name_iid, found->second);
        if (fresh) {
          Message entry, data;
          entry.varint(field::name_iid, found->second);
          entry.text(field::name_name, found->first);
          data.message(field::event_names, entry);
          made.message(field::interned_data, data);
        }
        if (const auto link = links.find(&record); link != links.end())
          event.fixed64(record.kind() == trace::kind_send ? field::event_flows : field::event_last_flows,
                        link->second);
      }
      made.message(field::track_event, event);
      add(made);
    };
    in_order(
        track, window, [&](const Record& r) { slice(r, true); }, [&](const Record& r) { slice(r, false); });
  }
  return out;
}

std::string to_paje(const trace::Trace& trace, const TraceWindow& window) {
  // Event numbers are ours; what they mean stands in the head of the file.
  std::string out = R"(%EventDef PajeDefineContainerType 0
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

  // The format wants all events in order of time.
  struct Happening {
    double time;
    std::string text;
  };
  std::vector<Happening> happenings;
  const std::unordered_map<const Record*, std::size_t> links = links_of(trace, window);
  const auto link = [&](char event, double time, const std::string& here, const Record& r) {
    if (const auto found = links.find(&r); found != links.end())
      happenings.push_back(
          {time, fmt::format("{} {:.9f} message all m {} {}", event, time, here, found->second)});
  };
  const auto start = static_cast<double>(first_begin(trace, window));
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
    in_order(track, window, begin, end);
  }
  std::stable_sort(happenings.begin(), happenings.end(),
                   [](const Happening& a, const Happening& b) { return a.time < b.time; });
  for (const Happening& happening : happenings) line("{}", happening.text);
  return out;
}

}  // namespace talus::io
