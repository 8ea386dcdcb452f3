#pragma once

/// trace.h5 (docs/formats.md): written block by block while a run goes on, read as a whole.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "runtime/trace/recorder.hpp"
#include "runtime/trace/trace.hpp"

namespace talus::io {

/// When a clock of a rank was compared with that of rank 0: at `time`, what must be added to it. [ns]
struct ClockOffset {
  double time = 0;
  double offset = 0;
};

/// The clock of one rank at the beginning and at the end of the trace.
struct RankClock {
  std::int32_t rank = 0;
  std::array<ClockOffset, 2> offsets{};
};

/// The file that a rank writes to while the run goes on; in the end that of rank 0 has all.
std::filesystem::path trace_file_of(const std::filesystem::path& directory, int rank);

/// Writes the file of one rank, or one for all. The file is closed between blocks, and a block gets its name
/// when it is whole, so that a killed run leaves a file that can be read, if the tasks came first (as
/// trace::Recorder hands them over). The clock of a rank comes last, and says that all of it is there. Blocks
/// are written by one thread at a time.
class TraceWriter {
 public:
  /// Starts an empty file; of a prediction with what recorded_machine() says of its `machine`. Throws
  /// FileError.
  TraceWriter(const std::filesystem::path& path, int ranks, int threads, bool predicted,
              const std::vector<trace::KindInfo>& kinds,
              const std::optional<trace::Machine>& machine = std::nullopt);
  const std::string& path() const { return path_; }
  void append(const trace::Block& block);
  void append(std::int32_t rank, const std::vector<trace::Task>& tasks);
  void append(const RankClock& clock);
  /// All blocks, tasks and clocks of another file.
  void append_file(const std::filesystem::path& other);

 private:
  template <class Write>
  void add(const char* group, std::size_t index, Write write);

  std::string path_;
  std::size_t records_ = 0, plans_ = 0, tasks_ = 0, clocks_ = 0;  ///< written so far
};

/// Writes a trace to a new file. Throws FileError.
void write_trace(const std::filesystem::path& path, const trace::Trace& trace);

/// The whole trace, with all clocks turned to that of rank 0. Of a run that was killed the steps that are
/// there of all threads: each writes when its buffer is full. Throws FileError when the file is not a trace,
/// is damaged, or lacks what it refers to, when no step is whole, or when a run of several ranks was killed:
/// their clocks were never compared.
trace::Trace read_trace(const std::filesystem::path& path);

}  // namespace talus::io
