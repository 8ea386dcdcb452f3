#pragma once

/// Everything that a run leaves behind, in one place (docs/formats.md has the list of files).
///
///     Recorder recorder(directory, options, setup, provenance);  // run.json says "running"
///     recorder.record_step(report, wall_reports, triaxial);  // every step: a line in each table
///     recorder.flush();                                      // now and then: the lines go to the system
///     recorder.record_frame(std::move(frame));               // now and then: results.h5, fields, pictures
///     recorder.close();
///     write_run_json(...);                                   // says what came of it, however it ended
///
/// Not locked: calls come one after the other, from one thread at a time (the service thread of the graph
/// runs beside the steps and is such a thread). HDF5 allows no other thread in it meanwhile.

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/results/csv_writer.hpp"
#include "io/results/results.hpp"
#include "io/results/run_json.hpp"
#include "io/results/vtk.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/iteration.hpp"
#include "runtime/step/setup.hpp"

namespace talus::io {

struct RecorderOptions {
  bool frames = true;    ///< results.h5
  bool fields = true;    ///< fields/ and fields.pvd
  bool contacts = true;  ///< false: the frames and fields hold no contacts
  bool pictures = true;  ///< triaxial.svg, forces.svg; the latter needs contacts
};

/// At most 2 x `capacity` rows of one stage, evenly spread over it, however long it lasts: when full, every
/// second row is dropped and only every second one is taken from then on. For drawing.
class ThinnedCurve {
 public:
  explicit ThinnedCurve(std::size_t capacity = 1000) : capacity_(capacity) {}
  /// A row of another stage than the last one begins a new curve.
  void add(const TriaxialReport& report);
  /// The rows kept, and the newest one in any case.
  std::vector<TriaxialReport> rows() const;
  bool empty() const { return !newest_; }

 private:
  std::size_t capacity_;
  std::size_t stride_ = 1, count_ = 0;
  std::vector<TriaxialReport> kept_;
  std::optional<TriaxialReport> newest_;
};

/// Writes the files of a run. All functions throw FileError naming the file that could not be written.
class Recorder {
 public:
  /// `directory` is prepared (prepare_output_directory). Walls, and the axis of each stage for the pictures,
  /// are those of `setup`.
  Recorder(const std::filesystem::path& directory, const RecorderOptions& options, const Setup& setup,
           const Provenance& provenance);
  /// On several ranks, each of which has one. Collective, as are the frames; tables and pictures are rank
  /// 0's, and the other calls do nothing on others. `ranks` must outlive the recorder.
  Recorder(const std::filesystem::path& directory, const RecorderOptions& options, const Setup& setup,
           const Provenance& provenance, const graph::Communicator& ranks);

  /// A line in steps.csv, one per wall in walls.csv, and one in triaxial.csv if there is a report; that file
  /// appears with its first line.
  void record_step(const StepReport& report, std::span<const WallReport> walls,
                   const std::optional<TriaxialReport>& triaxial);

  /// A line in error_history.csv per check; the file appears with its first line.
  void record_errors(std::int64_t step, std::span<const Iteration::Check> checks);

  /// Hands the lines so far to the system: a run that is killed later has them.
  void flush();

  /// Writes a state, of which each rank has its part, and lets go of it. Throws std::invalid_argument when
  /// its arrays do not fit together.
  void record_frame(Frame&& frame);

  /// Completes the tables and pictures. Throws FileError; what is destroyed unclosed writes what it can.
  void close();
  std::size_t frames() const { return frames_; }  ///< recorded

 private:
  void write_fields(const Frame& frame);
  void draw_force_picture(const Frame& part) const;
  void draw_triaxial_picture() const;

  std::filesystem::path directory_;
  RecorderOptions options_;
  std::vector<Wall> walls_;
  std::map<std::string, int> axis_of_stage_;
  Provenance provenance_;
  const graph::Communicator& ranks_;
  std::optional<CsvFile> steps_, wall_rows_;  ///< on rank 0
  std::optional<CsvFile> triaxial_;
  std::optional<CsvFile> errors_;
  std::optional<ResultsWriter> results_;
  std::vector<FieldFile> grain_files_, force_files_;  ///< paths relative to fields/
  ThinnedCurve curve_;
  std::size_t frames_ = 0;
};

}  // namespace talus::io
