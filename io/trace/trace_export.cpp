#include "io/trace/trace_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/trace/detail/trace_events.hpp"

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

/// Names of the records of one track; the plan is read once for each step.
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
  const std::int64_t start = detail::first_begin(trace, window);
  const std::unordered_map<const Record*, std::size_t> links = detail::links_of(trace, window);
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
    detail::in_order(
        track, window, [&](const Record& r) { slice(r, true); }, [&](const Record& r) { slice(r, false); });
  }
  return out;
}

}  // namespace talus::io
