#pragma once

/// What the columns of a run's tables mean: the text of columns.json, which stands beside them.

#include <span>
#include <string>
#include <string_view>

namespace talus::io {

struct ColumnMeaning {
  std::string_view name;     ///< as in the header
  std::string_view unit;     ///< SI; "1" where there is none, "" for texts
  std::string_view meaning;  ///< one line
};

/// The columns of one table, in the order of its header.
struct TableMeaning {
  std::string_view file;  ///< "steps.csv"
  std::span<const ColumnMeaning> columns;
};

/// All tables that a run may write.
std::span<const TableMeaning> column_dictionary();

/// The dictionary as JSON: {"steps.csv": [{"name": "step", "unit": "1", "meaning": "..."}, ...], ...}.
std::string columns_json();

}  // namespace talus::io
