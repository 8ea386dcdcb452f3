#include <fcntl.h>

#include <utility>

#include "io/files/error.hpp"
#include "io/results/csv_writer.hpp"

namespace talus::io {

CsvFile::CsvFile(const std::filesystem::path& path, std::string_view header)
    : file_(path, O_WRONLY | O_CREAT | O_TRUNC), pending_(header) {
  flush();
}

CsvFile::CsvFile(const std::filesystem::path& path, const FileMark& mark)
    : file_(path, O_WRONLY | O_APPEND), written_(mark) {
  file_.cut(mark.bytes);
}

CsvFile::~CsvFile() {
  try {
    close();
  } catch (const FileError&) {
    // Nobody is left to be told; close() is the way to know.
  }
}

void CsvFile::flush() {
  if (pending_.empty()) return;
  // Emptied first: lines that failed are not tried again, lest half of them appear twice.
  const std::string lines = std::exchange(pending_, {});
  file_.write(lines);
  written_.bytes += static_cast<std::int64_t>(lines.size());
  written_.crc = crc_of(lines, written_.crc);
}

FileMark CsvFile::sync() {
  flush();
  file_.sync();
  return written_;
}

void CsvFile::close() {
  flush();
  file_.close();
}

}  // namespace talus::io
