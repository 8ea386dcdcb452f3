#include "io/results/csv_reader.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>

#include "io/files/error.hpp"

namespace talus::io {

namespace {

/// The cells of a line one by one; texts may be quoted (RFC 4180), and hold no line ends.
class Cells {
 public:
  Cells(std::string_view line, const std::filesystem::path& path) : line_(line), path_(path) {}

  std::string text() {
    if (ended_) fail();
    std::string cell;
    bool quoted = !line_.empty() && line_.front() == '"';
    if (quoted) line_.remove_prefix(1);
    for (; !line_.empty(); line_.remove_prefix(1)) {
      if (quoted && line_.starts_with("\"\"")) {
        line_.remove_prefix(1);
      } else if (quoted && line_.front() == '"') {
        quoted = false;
        continue;
      } else if (!quoted && line_.front() == ',') {
        break;
      }
      cell += line_.front();
    }
    ended_ = line_.empty();
    if (!ended_) line_.remove_prefix(1);
    return cell;
  }
  template <class Number>
  void operator()(Number& number) {
    const std::string cell = text();
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), number);
    if (error != std::errc{} || end != cell.data() + cell.size()) fail();
  }
  void end() const {
    if (!ended_) fail();
  }
  bool ended() const { return ended_; }

 private:
  [[noreturn]] void fail() const {
    throw FileError(path_.string(),
                    "is not as Talus wrote it: restore it, or run the scene anew in another directory");
  }

  std::string_view line_;
  const std::filesystem::path& path_;
  bool ended_ = false;
};

TriaxialReport report_of(std::string_view line, const std::filesystem::path& path) {
  Cells cell(line, path);
  TriaxialReport report;
  cell(report.step);
  cell(report.time);
  report.stage = cell.text();
  for (double& strain : report.strain) cell(strain);
  cell(report.strain_volume);
  cell(report.strain_shear);
  cell(report.solid_fraction);
  for (double& stress : report.stress) cell(stress);
  cell(report.p);
  cell(report.q);
  cell(report.q_over_p);
  cell(report.coordination);
  int converged = 0;
  cell(converged);
  report.converged = converged != 0;
  cell.end();
  return report;
}

}  // namespace

std::vector<TriaxialReport> read_triaxial(const std::filesystem::path& path) {
  std::vector<TriaxialReport> rows;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);  // the header
  while (std::getline(file, line)) rows.push_back(report_of(line, path));
  return rows;
}

const std::vector<double>& TableColumns::operator[](const std::string& name) const {
  static const std::vector<double> none;
  const auto found = numbers.find(name);
  return found == numbers.end() ? none : found->second;
}

TableColumns read_columns(const std::filesystem::path& path, const std::vector<std::string>& names,
                          const std::string& text) {
  TableColumns table;
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) return table;
  std::vector<std::vector<double>*> place;  // of each column: where its numbers go
  std::size_t text_column = std::numeric_limits<std::size_t>::max();
  for (Cells header(line, path); !header.ended();) {
    const std::string name = header.text();
    if (!text.empty() && name == text) text_column = place.size();
    const bool wanted = std::find(names.begin(), names.end(), name) != names.end();
    place.push_back(wanted ? &table.numbers[name] : nullptr);
  }
  while (std::getline(file, line) && !file.eof()) {
    Cells cells(line, path);
    for (std::size_t k = 0; k < place.size(); ++k) {
      const std::string cell = cells.text();
      if (k == text_column) table.texts.push_back(cell);
      if (!place[k]) continue;
      double number = std::numeric_limits<double>::quiet_NaN();
      std::from_chars(cell.data(), cell.data() + cell.size(), number);
      place[k]->push_back(number);
    }
  }
  return table;
}

}  // namespace talus::io
