/// The tables of a run as CSV: a line for each step, wall, triaxial report and check of the error.

#include <algorithm>
#include <array>

#include "io/output/sinks.hpp"
#include "io/results/csv_writer.hpp"

namespace talus::io {
namespace {

constexpr std::array<std::string_view, 4> names{"steps.csv", "walls.csv", "triaxial.csv",
                                                "error_history.csv"};

class TableSink : public OutputSink {
 public:
  explicit TableSink(const OutputContext& context)
      : context_(context), directory_(context.directory), writes_(context.ranks.rank() == 0) {}

  void open() override {
    if (!writes_) return;
    steps_.emplace(directory_ / names[0], steps_csv_header());
    walls_.emplace(directory_ / names[1], walls_csv_header());
  }

  void resume(const OutputMark& mark) override {
    if (!writes_) return;
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto known = mark.bytes.find(std::string(names[k]));
      const std::filesystem::path path = directory_ / names[k];
      if (known != mark.bytes.end())
        tables()[k]->emplace(path, known->second);
      else
        std::filesystem::remove(path);
    }
  }
  void mark(OutputMark& mark) override {
    for (std::size_t k = 0; k < names.size(); ++k)
      if (*tables()[k]) mark.bytes[std::string(names[k])] = (*tables()[k])->sync();
  }

  /// triaxial.csv and error_history.csv appear with their first line.
  void step(const StepRecord& record) override {
    append_steps_row(steps_->pending(), record.step);
    const bool line = context_.has_table_line(record.step.step);
    for (const WallReport& wall : record.walls)
      if (line) append_walls_row(walls_->pending(), record.step, wall);
    if (record.triaxial && line) {
      if (!triaxial_) triaxial_.emplace(directory_ / names[2], triaxial_csv_header());
      append_triaxial_row(triaxial_->pending(), *record.triaxial);
    }
    if (record.errors.empty()) return;
    if (!errors_) errors_.emplace(directory_ / names[3], error_history_csv_header());
    for (const ErrorCheck& check : record.errors)
      append_error_history_row(errors_->pending(), record.step.step, check);
  }

  void flush() override {
    for (std::optional<CsvFile>* table : tables())
      if (*table) (*table)->flush();
  }
  void close() override {
    for (std::optional<CsvFile>* table : tables())
      if (*table) (*table)->close();
  }

 private:
  std::array<std::optional<CsvFile>*, 4> tables() { return {&steps_, &walls_, &triaxial_, &errors_}; }

  OutputContext context_;
  std::filesystem::path directory_;
  bool writes_;
  std::optional<CsvFile> steps_, walls_, triaxial_, errors_;
};

}  // namespace

const SinkKind table_sink{
    SinkUse::always,
    [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
      return std::make_unique<TableSink>(context);
    },
    [](const std::string& name) { return std::find(names.begin(), names.end(), name) != names.end(); }};

}  // namespace talus::io
