/// What a trace costs: a record, a block on its way to the file, a task in replay.

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "io/trace/trace_file.hpp"
#include "runtime/step/task_kinds.hpp"
#include "runtime/trace/analysis.hpp"
#include "runtime/trace/replay.hpp"
#include "tests/bench/clocks.hpp"

namespace {

using namespace talus;
using bench::wall_now;

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Seconds per record, a look at the clock included: a task begins where the last one ended.
double record_time() {
  std::vector<double> times;
  for (int repeat = 0; repeat < 15; ++repeat) {
    trace::Recorder recorder({.sink = [](trace::Block&&) {}});
    recorder.begin_step(1);
    constexpr int count = 1 << 17;
    const double start = wall_now();
    std::int64_t begin = recorder.now();
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::int64_t end = recorder.now();
      recorder.track(0).add(begin, end, i, 0, trace::kind_check);
      begin = end;
    }
    times.push_back((wall_now() - start) / count);
  }
  return median(times);
}

/// Seconds per block of so many records, written and the file closed.
double block_time(const std::filesystem::path& path, std::size_t records) {
  io::TraceWriter writer(path, 1, 1, false, task_kinds());
  const trace::Block block{0, 0, std::vector<trace::Record>(records), std::nullopt};
  std::vector<double> times;
  for (int repeat = 0; repeat < 31; ++repeat) {
    const double start = wall_now();
    writer.append(block);
    times.push_back(wall_now() - start);
  }
  return median(times);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    const std::filesystem::path file = std::filesystem::temp_directory_path() / "talus_bench_trace.h5";
    fmt::print("record {:.1f} ns\n", 1e9 * record_time());
    for (std::size_t records : {std::size_t{1}, std::size_t{1} << 16, std::size_t{1} << 17})
      fmt::print("block of {} records {:.3f} ms\n", records, 1e3 * block_time(file, records));
    std::filesystem::remove(file);
    fmt::print("for the replay of a trace: bench_trace FILE [RANKS THREADS]\n");
    return 0;
  }
  double start = wall_now();
  const trace::Trace trace = io::read_trace(argv[1]);
  fmt::print(
      "read {:.2f} s, {} records, {:.1f} bytes a record in the file\n", wall_now() - start,
      trace.record_count(),
      static_cast<double>(std::filesystem::file_size(argv[1])) / static_cast<double>(trace.record_count()));
  trace::Machine machine = trace::recorded_machine(trace);
  if (argc > 3) {
    machine.ranks = std::atoi(argv[2]);
    machine.threads = std::atoi(argv[3]);
  }
  start = wall_now();
  const trace::Timeline timeline(trace);
  const trace::Replay replay = trace::replay(timeline, machine, true);
  const double took = wall_now() - start;
  fmt::print("replay {:.2f} s, {} tasks, {:.2f} us a task, {:.0f} MB held\n", took, replay.tasks,
             1e6 * took / static_cast<double>(replay.tasks),
             1e-6 * static_cast<double>(memory_used(trace) + memory_used(replay.trace)));
  start = wall_now();
  trace::analyse(replay.trace);
  fmt::print("analysis {:.2f} s\n", wall_now() - start);
  return 0;
}
