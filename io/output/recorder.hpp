#pragma once

/// Everything that a run leaves behind, in one place (docs/formats.md has the list of files).
///
///     Recorder recorder(output_context(directory, setup), default_sinks());
///     recorder.open();                          // the files are there; run.json says "running"
///                                               // or resume(mark), of a run that goes on
///     recorder.record_step(record);             // every step: a line in each table
///     recorder.flush();                         // now and then: the lines go to the system
///     recorder.record_frame(std::move(frame));  // now and then: results.h5, fields, pictures
///     recorder.close();
///     recorder.end(summary);                    // run.json says what came of it, however it ended
///
/// Not locked: calls come one after the other, from one thread at a time (the service thread of the graph
/// runs beside the steps and is such a thread). HDF5 allows no other thread in it meanwhile.

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "io/output/output_sink.hpp"
#include "runtime/graph/one_rank.hpp"

namespace talus::io {

/// For the run of `setup`, whose walls and stages it copies, on one rank or on `ranks`, which must outlive
/// it.
OutputContext output_context(const std::filesystem::path& directory, const Setup& setup,
                             const graph::Communicator& ranks = graph::one_rank());

/// Drives the sinks of a run; each rank has one. All functions throw FileError naming the file that could not
/// be written.
class Recorder {
 public:
  /// Of those that always take part, and of the other `names` (sink_registry).
  Recorder(OutputContext context, const std::set<std::string>& names);

  /// Collective, as are the frames; the other calls do nothing on other ranks than 0.
  void open();
  /// Collective. Files that are there are cut back to the mark: of a run that goes on from a checkpoint.
  void resume(const OutputMark& mark);
  /// Where the files are, all of it on the disk; nothing on other ranks than 0.
  OutputMark mark();

  void record_step(const StepRecord& record);

  /// Hands the lines so far to the system: a run that is killed later has them.
  void flush();

  /// Writes a state, of which each rank has its part, and releases it. Throws std::invalid_argument when its
  /// arrays do not fit together.
  void record_frame(Frame&& frame);

  /// Completes the files. A recorder that is destroyed without it writes what it can.
  void close();

  /// Says what came of the run, also where a call before failed.
  void end(const Summary& summary);

  std::size_t frames() const {
    return frame_times_.size();
  }  ///< recorded, those before a resumption among them

 private:
  OutputContext context_;
  std::vector<std::unique_ptr<OutputSink>> sinks_;
  std::vector<double> frame_times_;  ///< [s]
};

}  // namespace talus::io
