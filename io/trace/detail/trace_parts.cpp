#include "io/trace/detail/trace_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <stdexcept>

#include "io/files/error.hpp"

namespace talus::io::detail {

namespace {

/// A list of lists as offsets and one list.
struct Lists {
  std::vector<std::uint32_t> offset{0}, entry;
  void add(const std::vector<std::uint32_t>& list) {
    entry.insert(entry.end(), list.begin(), list.end());
    offset.push_back(static_cast<std::uint32_t>(entry.size()));
  }
};

template <class Part, class Get>
auto column(const std::vector<Part>& parts, Get get) {
  std::vector<decltype(get(parts.front()))> values;
  values.reserve(parts.size());
  for (const Part& part : parts) values.push_back(get(part));
  return values;
}

/// Lengths that must agree, by name.
void demand_length(const std::string& file, const std::string& where, std::size_t length,
                   std::size_t expected) {
  if (length != expected)
    damaged_trace(file, fmt::format("{} has {} entries, expected {}", where, length, expected));
}

}  // namespace

void damaged_trace(const std::string& file, const std::string& what) {
  throw FileError(file, what + ": the file is damaged, or was written by another version; record it again");
}

Hdf5Object record_type(const std::string& file) {
  Hdf5Object type = hold(H5Tcreate(H5T_COMPOUND, sizeof(trace::Record)), H5Tclose, file, "preparing records");
  const auto insert = [&](const char* name, std::size_t offset, hid_t member) {
    demand(H5Tinsert(type.id(), name, offset, member), file, "preparing records");
  };
  insert("begin", offsetof(trace::Record, begin), H5T_STD_I64LE);
  insert("duration", offsetof(trace::Record, duration), H5T_IEEE_F32LE);
  insert("node", offsetof(trace::Record, node), H5T_STD_U32LE);
  insert("epoch", offsetof(trace::Record, epoch), H5T_STD_I32LE);
  insert("step_and_kind", offsetof(trace::Record, step_and_kind), H5T_STD_U32LE);
  return type;
}

void write_kinds(Place place, const std::vector<trace::KindInfo>& kinds) {
  using trace::KindInfo;
  write_names(place, "name", column(kinds, [](const KindInfo& k) { return k.name; }));
  write_array(place, "phase", "1",
              column(kinds, [](const KindInfo& k) { return static_cast<std::uint8_t>(k.phase); }));
  write_array(place, "blocked", "1",
              column(kinds, [](const KindInfo& k) { return static_cast<std::uint8_t>(k.blocked); }));
  write_array(place, "shared", "1",
              column(kinds, [](const KindInfo& k) { return static_cast<std::uint8_t>(k.shared); }));
}

void write_tasks(Place place, std::int32_t rank, const std::vector<trace::Task>& tasks) {
  using trace::Task;
  write_attribute(place, "rank", std::int64_t{rank});
  Lists before;
  for (const Task& task : tasks) before.add(task.predecessors);
  write_names(place, "name", column(tasks, [](const Task& t) { return t.name; }));
  write_array(place, "kind", "1",
              column(tasks, [](const Task& t) { return static_cast<std::uint8_t>(t.kind); }));
  write_array(place, "group", "1", column(tasks, [](const Task& t) { return t.group; }));
  write_array(place, "team", "1",
              column(tasks, [](const Task& t) { return static_cast<std::uint8_t>(t.team); }));
  write_array(place, "offset", "1", before.offset);
  write_array(place, "predecessor", "1", before.entry);
}

void write_plan(Place place, const trace::Plan& plan) {
  write_attribute(place, "rank", std::int64_t{plan.rank});
  write_attribute(place, "step", std::int64_t{plan.step});
  write_array(place, "colour", "1", plan.colour);
  write_array(place, "group", "1", plan.group);
  write_array(place, "role", "1", plan.role);
  write_array(place, "weight", "contacts", plan.weight);
  write_array(place, "place", "1", plan.place);
  write_array(place, "owner", "1", plan.owner);
  write_array(place, "offset", "1", plan.offset);
  write_array(place, "neighbour", "1", plan.neighbour);
  std::vector<std::array<std::uint32_t, 3>> messages;
  for (const trace::Message& m : plan.messages) messages.push_back({m.from, m.to, m.bytes});
  write_array(place, "messages", "1, 1, byte", messages);
}

void write_machine(Place place, const trace::Machine& machine) {
  write_attribute(place, "map", name_of(machine.map));
  write_attribute(place, "ranks_per_node", std::int64_t{machine.ranks_per_node});
  write_attribute(place, "node_latency", machine.node_latency);
}

std::vector<trace::KindInfo> read_kinds(Place place) {
  const auto names = read_names(place, "name");
  const auto phase = read_array<std::uint8_t>(place, "phase"),
             blocked = read_array<std::uint8_t>(place, "blocked"),
             shared = read_array<std::uint8_t>(place, "shared");
  for (std::size_t length : {phase.size(), blocked.size(), shared.size()})
    demand_length(place.file, "/kinds", length, names.size());
  std::vector<trace::KindInfo> kinds;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (phase[k] >= trace::phase_count) damaged_trace(place.file, "kind '" + names[k] + "'");
    kinds.push_back({names[k], static_cast<trace::Phase>(phase[k]), blocked[k] != 0, shared[k] != 0});
  }
  return kinds;
}

trace::Machine read_machine(Place place) {
  trace::Machine machine;
  try {
    machine.map = trace::rank_map_named(read_text(place, "map"));
  } catch (const std::invalid_argument& error) {
    damaged_trace(place.file, error.what());
  }
  machine.ranks_per_node = static_cast<int>(read_integer(place, "ranks_per_node"));
  read_attribute(place, "node_latency", H5T_NATIVE_DOUBLE, &machine.node_latency);
  return machine;
}

std::vector<trace::Task> read_tasks(Place place) {
  const auto names = read_names(place, "name");
  const auto kind = read_array<std::uint8_t>(place, "kind"), team = read_array<std::uint8_t>(place, "team");
  const auto group = read_array<std::int32_t>(place, "group");
  const auto offset = read_array<std::uint32_t>(place, "offset"),
             before = read_array<std::uint32_t>(place, "predecessor");
  if (offset.empty()) damaged_trace(place.file, "/tasks/offset");
  for (std::size_t length : {kind.size(), team.size(), group.size(), offset.size() - 1})
    demand_length(place.file, "/tasks", length, names.size());
  if (!std::is_sorted(offset.begin(), offset.end()) || offset.back() != before.size())
    damaged_trace(place.file, "/tasks/offset");
  std::vector<trace::Task> tasks;
  for (std::size_t k = 0; k < names.size(); ++k)
    tasks.push_back({names[k],
                     static_cast<trace::Kind>(kind[k]),
                     group[k],
                     team[k] != 0,
                     {before.begin() + offset[k], before.begin() + offset[k + 1]}});
  return tasks;
}

trace::Plan read_plan(Place place) {
  trace::Plan plan;
  plan.rank = static_cast<std::int32_t>(read_integer(place, "rank"));
  plan.step = static_cast<std::uint32_t>(read_integer(place, "step"));
  plan.colour = read_array<std::uint32_t>(place, "colour");
  plan.group = read_array<std::uint32_t>(place, "group");
  plan.role = read_array<std::uint8_t>(place, "role");
  plan.weight = read_array<std::uint32_t>(place, "weight");
  plan.place = read_array<std::uint32_t>(place, "place");
  plan.owner = read_array<std::uint32_t>(place, "owner");
  plan.offset = read_array<std::uint32_t>(place, "offset");
  plan.neighbour = read_array<std::uint32_t>(place, "neighbour");
  for (const auto& m : read_array<std::array<std::uint32_t, 3>>(place, "messages", H5T_NATIVE_UINT32, 3))
    plan.messages.push_back({static_cast<std::uint16_t>(m[0]), static_cast<std::uint16_t>(m[1]), m[2]});
  return plan;
}

Hdf5Object open_group(Place place, const std::string& name) {
  return hold(H5Gopen2(place.group, name.c_str(), H5P_DEFAULT), H5Gclose, place.file, "opening " + name);
}

trace::Block read_records(Place root, const std::string& name) {
  const Hdf5Object dataset =
      hold(H5Dopen2(root.group, name.c_str(), H5P_DEFAULT), H5Dclose, root.file, "opening " + name);
  const Place place{dataset.id(), root.file};
  return {static_cast<std::int32_t>(read_integer(place, "rank")),
          static_cast<std::int32_t>(read_integer(place, "thread")),
          read_array<trace::Record>(root, name, record_type(root.file).id(), 1), std::nullopt};
}

RankClock read_clock(Place root, const std::string& name) {
  const Hdf5Object group = open_group(root, name);
  const Place place{group.id(), root.file};
  const auto values = read_array<double>(place, "offsets");
  demand_length(root.file, name, values.size(), 4);
  return {static_cast<std::int32_t>(read_integer(place, "rank")),
          {ClockOffset{values[0], values[1]}, ClockOffset{values[2], values[3]}}};
}

}  // namespace talus::io::detail
