#include "io/results/csv_reader.hpp"

#include <charconv>
#include <fstream>
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

 private:
  [[noreturn]] void fail() const {
    throw FileError(path_.string(), "is not as Talus wrote it; begin anew in another directory");
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

}  // namespace talus::io
