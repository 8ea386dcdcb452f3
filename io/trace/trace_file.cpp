#include "io/trace/trace_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "io/files/detail/hdf5_read.hpp"
#include "io/files/detail/hdf5_write.hpp"
#include "io/files/error.hpp"
#include "io/results/version.hpp"

namespace talus::io {

namespace fs = std::filesystem;

namespace {

using detail::demand;
using detail::Hdf5Object;
using detail::hold;
using detail::Place;
using detail::read_array;
using detail::read_integer;
using detail::write_array;
using detail::write_attribute;

constexpr std::int64_t format_version = 4;         // 3: ranks of another tree, walls told with publish
constexpr std::size_t largest_machine = 1U << 24;  ///< tracks; more is a damaged number

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

void write_kinds(Place place, const std::vector<trace::KindInfo>& kinds) {
  using trace::KindInfo;
  detail::write_names(place, "name", column(kinds, [](const KindInfo& k) { return k.name; }));
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
  detail::write_names(place, "name", column(tasks, [](const Task& t) { return t.name; }));
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

[[noreturn]] void damaged(const std::string& file, const std::string& what) {
  throw FileError(file, what + ": the file is damaged, or was written by another version; record it again");
}

/// Lengths that must agree, by name.
void demand_length(const std::string& file, const std::string& where, std::size_t length,
                   std::size_t expected) {
  if (length != expected)
    damaged(file, fmt::format("{} has {} entries, expected {}", where, length, expected));
}

std::vector<trace::KindInfo> read_kinds(Place place) {
  const auto names = detail::read_names(place, "name");
  const auto phase = read_array<std::uint8_t>(place, "phase"),
             blocked = read_array<std::uint8_t>(place, "blocked"),
             shared = read_array<std::uint8_t>(place, "shared");
  for (std::size_t length : {phase.size(), blocked.size(), shared.size()})
    demand_length(place.file, "/kinds", length, names.size());
  std::vector<trace::KindInfo> kinds;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (phase[k] >= trace::phase_count) damaged(place.file, "kind '" + names[k] + "'");
    kinds.push_back({names[k], static_cast<trace::Phase>(phase[k]), blocked[k] != 0, shared[k] != 0});
  }
  return kinds;
}

trace::Machine read_machine(Place place) {
  trace::Machine machine;
  try {
    machine.map = trace::rank_map_named(detail::read_text(place, "map"));
  } catch (const std::invalid_argument& error) {
    damaged(place.file, error.what());
  }
  machine.ranks_per_node = static_cast<int>(read_integer(place, "ranks_per_node"));
  detail::read_attribute(place, "node_latency", H5T_NATIVE_DOUBLE, &machine.node_latency);
  return machine;
}

std::vector<trace::Task> read_tasks(Place place) {
  const auto names = detail::read_names(place, "name");
  const auto kind = read_array<std::uint8_t>(place, "kind"), team = read_array<std::uint8_t>(place, "team");
  const auto group = read_array<std::int32_t>(place, "group");
  const auto offset = read_array<std::uint32_t>(place, "offset"),
             before = read_array<std::uint32_t>(place, "predecessor");
  for (std::size_t length : {kind.size(), team.size(), group.size(), offset.size() - 1})
    demand_length(place.file, "/tasks", length, names.size());
  if (!std::is_sorted(offset.begin(), offset.end()) || offset.back() != before.size())
    damaged(place.file, "/tasks/offset");
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

/// The group of the file's own making, for reading.
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

/// A trace file, opened and known to be one.
Hdf5Object open_trace(const std::string& path) {
  if (!fs::exists(path)) throw FileError(path, "there is no such file");
  Hdf5Object file = detail::open_file(path);
  const std::string format = detail::read_text({file.id(), path}, "format");
  if (format != "talus-trace")
    throw FileError(
        path, fmt::format("is no trace of talus (its format is '{}'); `talus run --trace` writes one as "
                          "trace.h5",
                          format));
  if (const std::int64_t version = read_integer({file.id(), path}, "format_version");
      version != format_version)
    throw FileError(path, fmt::format("is of trace format {}, this talus reads {}: record it again", version,
                                      format_version));
  return file;
}

/// Turns the records of a rank to the clock of rank 0: the offset changes evenly between the two comparisons.
void turn_clock(const RankClock& clock, trace::Track& track) {
  const ClockOffset &first = clock.offsets[0], &last = clock.offsets[1];
  const double drift = last.time > first.time ? (last.offset - first.offset) / (last.time - first.time) : 0;
  for (trace::Record& record : track.records)
    record.begin += std::llround(first.offset + drift * (static_cast<double>(record.begin) - first.time));
}

/// What a trace says before its blocks, with tracks for these.
trace::Trace read_head(Place root) {
  trace::Trace trace;
  const std::int64_t ranks = read_integer(root, "ranks"), threads = read_integer(root, "threads");
  const auto most = static_cast<std::int64_t>(largest_machine);
  if (ranks < 1 || threads < 1 || ranks > most || threads > most || ranks * threads > most)
    damaged(root.file, fmt::format("{} ranks with {} threads", ranks, threads));
  trace.ranks = static_cast<int>(ranks);
  trace.threads = static_cast<int>(threads);
  trace.predicted = read_integer(root, "predicted") != 0;
  trace.kinds = read_kinds({open_group(root, "/kinds").id(), root.file});
  if (H5Lexists(root.group, "machine", H5P_DEFAULT) > 0) {
    trace.machine = read_machine({open_group(root, "/machine").id(), root.file});
    trace.machine->ranks = trace.ranks;
    trace.machine->threads = trace.threads;
  }
  trace.tasks.resize(static_cast<std::size_t>(ranks));
  for (std::int32_t rank = 0; rank < trace.ranks; ++rank)
    for (std::int32_t thread = 0; thread < trace.threads; ++thread)
      trace.tracks.push_back({rank, thread, {}});
  return trace;
}

trace::Track& lane_of(const std::string& file, trace::Trace& trace, std::int64_t rank, std::int64_t thread) {
  if (rank < 0 || rank >= trace.ranks || thread < 0 || thread >= trace.threads)
    damaged(file, fmt::format("records of rank {}, thread {}", rank, thread));
  return trace.tracks[static_cast<std::size_t>(rank * trace.threads + thread)];
}

/// Each rank on its own clock.
void add_blocks(Place root, trace::Trace& trace) {
  for (const std::string& tasks : detail::names_in(root, "/tasks")) {
    const Hdf5Object group = open_group(root, "/tasks/" + tasks);
    const std::int64_t rank = read_integer({group.id(), root.file}, "rank");
    lane_of(root.file, trace, rank, 0);
    trace.tasks[static_cast<std::size_t>(rank)] = read_tasks({group.id(), root.file});
  }
  for (const std::string& name : detail::names_in(root, "/plans"))
    trace.plans.push_back(read_plan({open_group(root, "/plans/" + name).id(), root.file}));
  for (const std::string& block : detail::names_in(root, "/records")) {
    const trace::Block read = read_records(root, "/records/" + block);
    std::vector<trace::Record>& records = lane_of(root.file, trace, read.rank, read.thread).records;
    records.insert(records.end(), read.records.begin(), read.records.end());
  }
}

/// What a killed run of one rank leaves: steps that all threads have gone on from. Throws FileError when
/// there is none.
void drop_cut_steps(const std::string& file, trace::Trace& trace) {
  std::uint32_t whole = trace::largest_step;
  for (const trace::Track& track : trace.tracks) {
    std::uint32_t last = 0;
    for (const trace::Record& record : track.records) last = std::max(last, record.step());
    whole = std::min(whole, last > 0 ? last - 1 : 0);
  }
  for (trace::Track& track : trace.tracks)
    std::erase_if(track.records, [&](const trace::Record& record) { return record.step() > whole; });
  std::erase_if(trace.plans, [&](const trace::Plan& plan) { return plan.step > whole; });
  if (trace.record_count() == 0 || trace.tasks.front().empty())
    throw FileError(file,
                    "is of a run that was stopped before a step of --trace-steps was written by all "
                    "threads: record it again");
}

}  // namespace

fs::path trace_file_of(const fs::path& directory, int rank) {
  return directory / (rank == 0 ? "trace.h5" : fmt::format("trace_rank_{:06}.h5", rank));
}

TraceWriter::TraceWriter(const fs::path& path, int ranks, int threads, bool predicted,
                         const std::vector<trace::KindInfo>& kinds,
                         const std::optional<trace::Machine>& machine)
    : path_(path.string()) {
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = detail::file_access(path_);
  Hdf5Object file = hold(H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.id()), H5Fclose, path_,
                         "creating the file");
  {
    const Place root{file.id(), path_};
    write_attribute(root, "format", std::string("talus-trace"));
    write_attribute(root, "format_version", format_version);
    write_attribute(root, "talus_version", version());
    write_attribute(root, "ranks", std::int64_t{ranks});
    write_attribute(root, "threads", std::int64_t{threads});
    write_attribute(root, "predicted", std::int64_t{predicted});
    write_kinds({detail::create_group(root, "kinds").id(), path_}, kinds);
    if (machine) write_machine({detail::create_group(root, "machine").id(), path_}, *machine);
    for (const char* name : {"records", "plans", "tasks", "clocks"}) detail::create_group(root, name);
  }
  detail::close_file(file, path_);
}

/// `write(place)` makes an object without a name, and returns it.
template <class Write>
void TraceWriter::add(const char* group, std::size_t index, Write write) {
  const detail::QuietHdf5 quiet;
  const Hdf5Object access = detail::file_access(path_);
  Hdf5Object file =
      hold(H5Fopen(path_.c_str(), H5F_ACC_RDWR, access.id()), H5Fclose, path_, "opening the file");
  {
    const Hdf5Object made = write(Place{file.id(), path_});
    const std::string name = fmt::format("/{}/{:08}", group, index);
    demand(H5Olink(made.id(), file.id(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), path_, "naming " + name);
  }
  detail::close_file(file, path_);
}

void TraceWriter::append(const trace::Block& block) {
  const auto new_group = [&](Place place) {
    return hold(H5Gcreate_anon(place.group, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, path_, "creating a group");
  };
  if (block.plan)
    add("plans", plans_++, [&](Place root) {
      Hdf5Object group = new_group(root);
      write_plan({group.id(), path_}, *block.plan);
      return group;
    });
  if (!block.tasks.empty()) append(block.rank, block.tasks);
  if (block.records.empty()) return;
  add("records", records_++, [&](Place root) {
    const hsize_t extent = block.records.size();
    const Hdf5Object space = hold(H5Screate_simple(1, &extent, nullptr), H5Sclose, path_, "writing records");
    const Hdf5Object type = record_type(path_);
    Hdf5Object dataset = hold(H5Dcreate_anon(root.group, type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT),
                              H5Dclose, path_, "writing records");
    demand(H5Dwrite(dataset.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, block.records.data()), path_,
           "writing records");
    write_attribute({dataset.id(), path_}, "rank", std::int64_t{block.rank});
    write_attribute({dataset.id(), path_}, "thread", std::int64_t{block.thread});
    return dataset;
  });
}

void TraceWriter::append(std::int32_t rank, const std::vector<trace::Task>& tasks) {
  add("tasks", tasks_++, [&](Place root) {
    Hdf5Object group =
        hold(H5Gcreate_anon(root.group, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, path_, "creating a group");
    write_tasks({group.id(), path_}, rank, tasks);
    return group;
  });
}

void TraceWriter::append(const RankClock& clock) {
  add("clocks", clocks_++, [&](Place root) {
    Hdf5Object group =
        hold(H5Gcreate_anon(root.group, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, path_, "creating a group");
    const Place place{group.id(), path_};
    write_attribute(place, "rank", std::int64_t{clock.rank});
    const auto& [first, last] = clock.offsets;
    write_array(place, "offsets", "ns",
                std::vector<double>{first.time, first.offset, last.time, last.offset});
    return group;
  });
}

void TraceWriter::append_file(const fs::path& other) {
  const std::string name = other.string();
  const detail::QuietHdf5 quiet;
  const Hdf5Object file = open_trace(name);
  const Place root{file.id(), name};
  for (const std::string& block : detail::names_in(root, "/records"))
    append(read_records(root, "/records/" + block));
  for (const std::string& plan : detail::names_in(root, "/plans"))
    append(trace::Block{0, 0, {}, read_plan({open_group(root, "/plans/" + plan).id(), name})});
  for (const std::string& tasks : detail::names_in(root, "/tasks")) {
    const Hdf5Object group = open_group(root, "/tasks/" + tasks);
    append(static_cast<std::int32_t>(read_integer({group.id(), name}, "rank")),
           read_tasks({group.id(), name}));
  }
  for (const std::string& clock : detail::names_in(root, "/clocks"))
    append(read_clock(root, "/clocks/" + clock));
}

void write_trace(const fs::path& path, const trace::Trace& trace) {
  TraceWriter writer(path, trace.ranks, trace.threads, trace.predicted, trace.kinds, trace.machine);
  for (const trace::Track& track : trace.tracks)
    writer.append(trace::Block{track.rank, track.thread, track.records, std::nullopt});
  for (const trace::Plan& plan : trace.plans) writer.append(trace::Block{plan.rank, 0, {}, plan});
  for (std::size_t rank = 0; rank < trace.tasks.size(); ++rank)
    writer.append(static_cast<std::int32_t>(rank), trace.tasks[rank]);
  for (std::int32_t rank = 0; rank < trace.ranks; ++rank) writer.append(RankClock{rank, {}});
}

trace::Trace read_trace(const fs::path& path) {
  const std::string name = path.string();
  const detail::QuietHdf5 quiet;
  const Hdf5Object file = open_trace(name);
  const Place root{file.id(), name};
  trace::Trace trace = read_head(root);
  const std::vector<std::string> clocks = detail::names_in(root, "/clocks");
  const bool cut = !trace.predicted && clocks.size() < static_cast<std::size_t>(trace.ranks);
  if (cut && trace.ranks > 1)
    throw FileError(name, fmt::format("is of a run on {} ranks that was killed before their traces were put "
                                      "together: record it again",
                                      trace.ranks));
  add_blocks(root, trace);
  std::stable_sort(trace.plans.begin(), trace.plans.end(), [](const trace::Plan& a, const trace::Plan& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.step < b.step;
  });
  if (trace.record_count() == 0)
    throw FileError(name,
                    "holds no tasks: the run ended before a step of --trace-steps was done, or was killed");
  for (const std::string& of_rank : clocks) {
    const RankClock clock = read_clock(root, "/clocks/" + of_rank);
    for (std::int32_t thread = 0; thread < trace.threads; ++thread)
      turn_clock(clock, lane_of(name, trace, clock.rank, thread));
  }
  if (cut) drop_cut_steps(name, trace);
  try {
    trace::sort_tracks(trace);
    trace::validate(trace);
  } catch (const trace::TraceError& error) {
    damaged(name, error.what());
  }
  return trace;
}

}  // namespace talus::io
