#include "io/scene/motion_file.hpp"

#include <array>
#include <fstream>
#include <string_view>
#include <vector>

#include "io/files/detail/utf8_mark.hpp"
#include "io/scene/detail/csv_fields.hpp"

namespace talus::io {

namespace {

using detail::CsvPlace;

/// Fields of a row, one more than there can be.
constexpr std::size_t most_fields = 6;
using MotionFields = std::array<std::string_view, most_fields>;

/// What the line of names announces.
struct MotionColumns {
  std::vector<std::string> names;
  bool way = false, speed = false, angle = false;
};

MotionColumns columns_of(std::string_view line, const CsvPlace& place) {
  MotionFields fields;
  const std::size_t count = detail::split(line, fields);
  MotionColumns columns;
  columns.names.assign(fields.begin(), fields.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<std::string> rest = columns.names;
  const auto take = [&](const std::vector<std::string>& wanted) {
    if (rest.size() < wanted.size() || !std::equal(wanted.begin(), wanted.end(), rest.begin())) return false;
    rest.erase(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(wanted.size()));
    return true;
  };
  const bool begins = take({"t"});
  columns.way = take({"x", "y", "z"});
  columns.speed = !columns.way && take({"vx", "vy", "vz"});
  columns.angle = take({"angle"});
  if (!begins || !rest.empty() || count < 2)
    place.fail("", fmt::format("the first line must be t[,x,y,z|,vx,vy,vz][,angle] with a column besides t, "
                               "got '{}'",
                               line));
  return columns;
}

void add_row(const MotionFields& fields, const MotionColumns& columns, const CsvPlace& place,
             MotionTable& table) {
  std::array<double, most_fields> value{};
  for (std::size_t k = 0; k < columns.names.size(); ++k)
    value[k] = detail::number_in<double>(fields[k], columns.names[k], place);
  if (table.t.empty() && value[0] != 0) place.fail("t", fmt::format("must begin at 0 s, got {}", value[0]));
  if (!table.t.empty() && !(value[0] > table.t.back()))
    place.fail("t", fmt::format("must ascend, got {} s after {} s", value[0], table.t.back()));
  table.t.push_back(value[0]);
  if (columns.way || columns.speed)
    (columns.way ? table.shift : table.velocity).emplace_back(value[1], value[2], value[3]);
  if (columns.angle) table.angle.push_back(value[columns.names.size() - 1]);
}

}  // namespace

MotionTable read_motion(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw SceneError(path, 0, "", "cannot open the table of a motion");
  MotionTable table;
  MotionColumns columns;
  MotionFields fields;
  CsvPlace place{path, 0};
  for (std::string text; std::getline(in, text);) {
    ++place.line;
    if (place.line == 1) text.erase(0, detail::utf8_mark_of(text));
    const std::string_view line = detail::trimmed(text);
    if (line.empty() || line.front() == '#') continue;
    if (columns.names.empty()) {
      columns = columns_of(line, place);
      continue;
    }
    if (const std::size_t found = detail::split(line, fields); found != columns.names.size())
      place.fail("", fmt::format("{} fields expected as in the first line, got {}", columns.names.size(),
                                 found < most_fields ? fmt::format("{}", found) : "more"));
    add_row(fields, columns, place, table);
  }
  if (table.t.size() < 2) place.fail("", "a motion needs two rows or more");
  if (columns.speed) integrate(table);
  for (std::size_t k = table.shift.size(); k-- > 0;) table.shift[k] -= table.shift[0];
  for (std::size_t k = table.angle.size(); k-- > 0;) table.angle[k] -= table.angle[0];
  return table;
}

}  // namespace talus::io
