#pragma once

/// What the columns of a run's tables mean: the text of columns.json, which stands beside them.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace talus::io {

struct ColumnMeaning {
  std::string name;          ///< as in the header
  std::string_view unit;     ///< SI; "1" where there is none, "" for texts
  std::string_view meaning;  ///< one line
};

/// The columns of one table, in the order of its header.
struct TableMeaning {
  std::string_view file;  ///< "steps.csv"
  std::vector<ColumnMeaning> columns;
};

/// The tables as JSON: {"steps.csv": [{"name": "step", "unit": "1", "meaning": "..."}, ...], ...}.
std::string columns_json(std::span<const TableMeaning> tables);

}  // namespace talus::io
