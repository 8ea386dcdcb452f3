#pragma once

/// The tables of a run: steps.csv, walls.csv, bodies.csv, inserted.csv, removed.csv, triaxial.csv, cell.csv,
/// error_history.csv (columns and units: docs/formats.md).

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/crc.hpp"
#include "io/files/detail/descriptor.hpp"
#include "io/results/column_dictionary.hpp"
#include "runtime/step/error_history.hpp"
#include "runtime/step/frame.hpp"

namespace talus::io {

/// Header lines, with line end.
std::string steps_csv_header();
std::string walls_csv_header();
std::string bodies_csv_header();
std::string inserted_csv_header();
std::string removed_csv_header();
std::string triaxial_csv_header();
std::string cell_csv_header();
std::string error_history_csv_header();
/// What the columns of these tables mean.
std::vector<TableMeaning> table_meanings();

/// Appends one line, with line end. Numbers are the shortest text that reads back as the same double; true
/// and false are 1 and 0; names are quoted only where they must be (RFC 4180).
void append_steps_row(std::string& text, const StepReport& report);
void append_walls_row(std::string& text, const StepReport& report, const WallReport& wall);
void append_bodies_row(std::string& text, const StepReport& report, const BodyReport& body);
void append_inserted_row(std::string& text, const StepReport& report, const InsertReport& insert);
void append_removed_row(std::string& text, const StepReport& report, const RemoveReport& remove);
void append_triaxial_row(std::string& text, const TriaxialReport& report);
void append_cell_row(std::string& text, const CellReport& report);
void append_error_history_row(std::string& text, std::int64_t step, const ErrorCheck& check);

/// A file that grows by whole lines: what a killed run leaves lacks those that were not flushed (a kill in
/// the middle of a write may cut one).
class CsvFile {
 public:
  /// Replaces a file of that name; the header is on disk when this returns. Throws FileError.
  CsvFile(const std::filesystem::path& path, std::string_view header);
  /// Goes on behind the mark of a file that is there; what it has more is cut off. Throws FileError, also
  /// when it has less.
  CsvFile(const std::filesystem::path& path, const FileMark& mark);
  /// Writes what is left. A destructor cannot report a failure: call close() to be told of one.
  ~CsvFile();

  /// Place to append whole lines.
  std::string& pending() { return pending_; }
  /// Hands the pending lines to the system. Throws FileError.
  void flush();
  /// The same, and waits until the disk has them. Returns how far the file has come. Throws
  /// FileError.
  FileMark sync();
  /// Flushes and closes. Throws FileError.
  void close();

 private:
  detail::Descriptor file_;
  std::string pending_;
  FileMark written_;  ///< handed to the system
};

}  // namespace talus::io
