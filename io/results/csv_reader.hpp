#pragma once

/// Tables of a run, read back.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "runtime/step/frame.hpp"

namespace talus::io {

/// The rows of a table as append_triaxial_row wrote them, to the bit; none where there is no such file.
/// Throws FileError when a line has another number of cells, or a cell is no number.
std::vector<TriaxialReport> read_triaxial(const std::filesystem::path& path);

/// Some columns of a table, which may be growing.
struct TableColumns {
  std::map<std::string, std::vector<double>>
      numbers;                     ///< by name, of equal length; NaN for what is no number
  std::vector<std::string> texts;  ///< of the one column of texts that was asked for

  /// A column; an empty one where the table has none of this name.
  const std::vector<double>& operator[](const std::string& name) const;
  std::size_t rows() const { return numbers.empty() ? texts.size() : numbers.begin()->second.size(); }
};

/// The columns of these names, and the texts of column `text` ("" for none); names that the table does not
/// have are left out. None where there is no such file. A last line without its end is left out: the run goes
/// on, or was killed. Throws FileError when a line has too few cells.
TableColumns read_columns(const std::filesystem::path& path, const std::vector<std::string>& names,
                          const std::string& text = "");

}  // namespace talus::io
