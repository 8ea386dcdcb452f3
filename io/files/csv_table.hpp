#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "io/files/detail/csv_cell.hpp"

namespace talus::io {

/// A small table that is written at once: text with a header line and a line per row. Cells are those of the
/// tables of a run (docs/formats.md, "Tables").
///
///     CsvTable table({"method", "seconds"});
///     table.row("nlgs", 0.25);
///     write_whole(path, table.text());
class CsvTable {
 public:
  explicit CsvTable(std::initializer_list<std::string_view> columns) {
    for (std::string_view column : columns) {
      detail::put(text_, column);
      text_ += ',';
    }
    text_.back() = '\n';
  }

  /// One cell per column, in their order.
  template <class... Cells>
  void row(const Cells&... cells) {
    ((detail::put(text_, cells), text_ += ','), ...);
    text_.back() = '\n';
  }

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace talus::io
