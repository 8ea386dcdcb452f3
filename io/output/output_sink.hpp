#pragma once

/// What a run can leave behind, as one interface: tables, frames, fields for viewers, pictures. The recorder
/// drives sinks and knows none of them; io/output/sinks.hpp lists them.
///
/// Calls come one after the other, never at the same time, though from different threads (recorder.hpp):
///
///     sink->open();                  // on every rank: the files are there, as of a run that has begun
///     sink->resume(mark);            // instead: the files are cut back to a mark, and go on from there
///     sink->step(step);              // on rank 0, after every step
///     sink->flush();                 // on rank 0, now and then: lines so far go to the system
///     sink->frame(part);             // on every rank, each with its part of the state
///     sink->mark(mark);              // on rank 0, behind flush(): where the files are now, on the disk
///     sink->close();                 // on rank 0: the files are complete
///     sink->end(summary);            // on rank 0, however the run ended, also where a call above failed
///
/// All of them throw FileError naming the file that could not be written.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/files/crc.hpp"
#include "io/results/grain_load.hpp"
#include "io/results/results.hpp"
#include "io/results/run_json.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/error_history.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"

namespace talus::io {

/// What sinks are made with.
struct OutputContext {
  std::filesystem::path directory;                ///< prepared (prepare_output_directory)
  bool contacts = true;                           ///< false: frames hold no contacts
  FrameFormat format = {};                        ///< of results.h5
  std::int64_t tables_every = 1;                  ///< steps between lines of walls, triaxial and cell.csv
  std::vector<Wall> walls = {};                   ///< in the order of Frame::walls
  bool periodic = false;                          ///< the sample stands in a periodic cell
  std::vector<std::string> material_names = {};   ///< of the setup
  GrainLoad load = {};                            ///< of the scene
  std::vector<Clump> clumps = {};                 ///< of the setup
  bool inserts = false;                           ///< grains come while the run goes on
  std::vector<std::string> grids = {};            ///< names of the fields of the setup
  std::map<std::string, int> axis_of_stage = {};  ///< 0, 1, 2: along which the strain of a stage is measured
  Provenance provenance = {};
  Summary begun = {};                ///< what run.json says while the run goes on
  const graph::Communicator& ranks;  ///< outlives the sinks

  /// Whether walls.csv, triaxial.csv and cell.csv, and what is drawn from them, have a line for that step.
  bool has_table_line(std::int64_t step) const { return step % tables_every == 0; }
};

/// What a step leaves, besides frames.
struct StepRecord {
  StepReport step = {};
  std::vector<WallReport> walls = {};           ///< in the order of the setup
  std::optional<TriaxialReport> triaxial = {};  ///< of a stage that has one
  std::vector<ErrorCheck> errors = {};          ///< checks of the error, where asked for
  std::vector<BodyReport> bodies = {};          ///< that the scene names
  std::vector<InsertReport> inserted = {};      ///< of each insertion
  std::vector<RemoveReport> removed = {};       ///< of each removal and material
  std::vector<ProbeReport> probes = {};         ///< that were due
  std::optional<CellReport> cell = {};          ///< of a periodic cell
};

/// How far the files of a run are: a checkpoint keeps it.
struct OutputMark {
  std::map<std::string, FileMark> files = {};  ///< that grow, by their names in the directory
  std::vector<double> frame_times = {};        ///< [s] of the frames
};

class OutputSink {
 public:
  virtual ~OutputSink() = default;
  virtual void open() {}
  virtual void resume(const OutputMark&) { open(); }
  virtual void mark(OutputMark&) {}
  virtual void step(const StepRecord&) {}
  virtual void flush() {}
  virtual void frame(const Frame&) {}
  virtual void close() {}
  virtual void end(const Summary&) {}
};

/// When a sink takes part.
enum class SinkUse {
  always,
  by_default,  ///< unless the scene's key of its name says false
  on_request,  ///< where the scene's key of its name says true
};

/// What is behind a line of the registry.
struct SinkKind {
  SinkUse use;
  std::unique_ptr<OutputSink> (*make)(const OutputContext&);
  /// Whether the sink may have written a file of that name, relative to the directory: --force removes it.
  bool (*writes)(const std::string& name);
};

}  // namespace talus::io
