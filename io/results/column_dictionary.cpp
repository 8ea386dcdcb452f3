#include "io/results/column_dictionary.hpp"

#include <nlohmann/json.hpp>

namespace talus::io {

std::string columns_json(std::span<const TableMeaning> tables) {
  nlohmann::ordered_json all;
  for (const TableMeaning& table : tables)
    for (const ColumnMeaning& column : table.columns)
      all[std::string(table.file)].push_back(
          {{"name", column.name}, {"unit", column.unit}, {"meaning", column.meaning}});
  return all.dump(2) + '\n';
}

}  // namespace talus::io
