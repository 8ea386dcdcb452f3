#include "io/trace/trace_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "io/files/error.hpp"
#include "io/results/version.hpp"
#include "io/trace/detail/trace_parts.hpp"

namespace talus::io {

namespace fs = std::filesystem;

namespace {

using detail::damaged_trace;
using detail::demand;
using detail::Hdf5Object;
using detail::hold;
using detail::open_group;
using detail::Place;
using detail::read_clock;
using detail::read_integer;
using detail::read_kinds;
using detail::read_machine;
using detail::read_plan;
using detail::read_records;
using detail::read_tasks;
using detail::record_type;
using detail::write_array;
using detail::write_attribute;
using detail::write_kinds;
using detail::write_machine;
using detail::write_plan;
using detail::write_tasks;

// 4: texts of variable length; 5: no checksums; 6: nothing of what threads can share of `whole`
constexpr std::int64_t format_version = 7;

/// A trace file, opened and known to be one.
Hdf5Object open_trace(const std::string& path) {
  if (!fs::exists(path)) throw FileError(path, "there is no such file");
  if (fs::is_directory(path)) {
    const fs::path inside = fs::path(path) / "trace.h5";
    throw FileError(path, fs::exists(inside) ? "is a folder; its trace is " + inside.string()
                                             : "is a folder without a trace.h5; `talus run --trace` writes "
                                               "one");
  }
  Hdf5Object file = detail::open_checked_file(path);
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

/// Brings the records of a rank to the clock of rank 0: the offset changes evenly between the two
/// comparisons.
void correct_clock(const std::string& file, const RankClock& clock, trace::Track& track) {
  constexpr double longest = 0x1p62;  // [ns]: sums of two are no overflow
  const ClockOffset &first = clock.offsets[0], &last = clock.offsets[1];
  const double drift = last.time > first.time ? (last.offset - first.offset) / (last.time - first.time) : 0;
  for (trace::Record& record : track.records) {
    const auto begin = static_cast<double>(record.begin);
    const double offset = first.offset + drift * (begin - first.time);
    if (!(std::abs(begin) < longest && std::abs(offset) < longest))
      damaged_trace(file, fmt::format("a task that begins at {} ns, by a clock {} ns off", begin, offset));
    record.begin += std::llround(offset);
  }
}

/// What a trace says before its blocks, with tracks for these.
trace::Trace read_head(Place root) {
  trace::Trace trace;
  const std::int64_t ranks = read_integer(root, "ranks"), threads = read_integer(root, "threads");
  // Each track has some bytes in the file: more tracks than bytes is a damaged number.
  const auto most = static_cast<std::int64_t>(std::min<std::uintmax_t>(fs::file_size(root.file), 1U << 24));
  if (ranks < 1 || threads < 1 || ranks > most || threads > most || ranks * threads > most)
    damaged_trace(root.file, fmt::format("{} ranks with {} threads", ranks, threads));
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

trace::Track& track_of(const std::string& file, trace::Trace& trace, std::int64_t rank, std::int64_t thread) {
  if (rank < 0 || rank >= trace.ranks || thread < 0 || thread >= trace.threads)
    damaged_trace(file, fmt::format("records of rank {}, thread {}", rank, thread));
  return trace.tracks[static_cast<std::size_t>(rank * trace.threads + thread)];
}

/// Each rank on its own clock.
void add_blocks(Place root, trace::Trace& trace) {
  for (const std::string& tasks : detail::names_in(root, "/tasks")) {
    const Hdf5Object group = open_group(root, "/tasks/" + tasks);
    const std::int64_t rank = read_integer({group.id(), root.file}, "rank");
    track_of(root.file, trace, rank, 0);
    trace.tasks[static_cast<std::size_t>(rank)] = read_tasks({group.id(), root.file});
  }
  for (const std::string& name : detail::names_in(root, "/plans"))
    trace.plans.push_back(read_plan({open_group(root, "/plans/" + name).id(), root.file}));
  for (const std::string& block : detail::names_in(root, "/records")) {
    const trace::Block read = read_records(root, "/records/" + block);
    std::vector<trace::Record>& records = track_of(root.file, trace, read.rank, read.thread).records;
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
  const Hdf5Object access = detail::checked_file_access(path_);
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
  const Hdf5Object access = detail::checked_file_access(path_);
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
      correct_clock(name, clock, track_of(name, trace, clock.rank, thread));
  }
  if (cut) drop_cut_steps(name, trace);
  try {
    trace::sort_tracks(trace);
    trace::validate(trace);
  } catch (const trace::TraceError& error) {
    damaged_trace(name, error.what());
  }
  return trace;
}

}  // namespace talus::io
