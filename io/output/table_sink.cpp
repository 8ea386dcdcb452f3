/// The tables of a run as CSV: a line for each step, wall, named body, insertion, removal, triaxial report,
/// cell and check of the error; and columns.json, which says what their columns mean.

#include <algorithm>
#include <array>

#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/results/column_dictionary.hpp"
#include "io/results/csv_writer.hpp"
#include "io/results/probe_csv.hpp"

namespace talus::io {
namespace {

enum Table : std::size_t { steps, walls, triaxial, errors, bodies, inserted, removed, cell, tables };
constexpr std::array<std::string_view, tables> names{"steps.csv",         "walls.csv",  "triaxial.csv",
                                                     "error_history.csv", "bodies.csv", "inserted.csv",
                                                     "removed.csv",       "cell.csv"};
constexpr std::array<std::string (*)(), tables> headers{
    steps_csv_header,  walls_csv_header,    triaxial_csv_header, error_history_csv_header,
    bodies_csv_header, inserted_csv_header, removed_csv_header,  cell_csv_header};

class TableSink : public OutputSink {
 public:
  explicit TableSink(const OutputContext& context)
      : context_(context), directory_(context.directory), writes_(context.ranks.rank() == 0) {}

  void open() override {
    if (!writes_) return;
    std::vector<TableMeaning> tables = table_meanings();
    tables.push_back(probes_meaning(context_.material_names));
    write_whole(directory_ / "columns.json", columns_json(tables));
    lines_of(steps);
    lines_of(walls);
  }

  void resume(const OutputMark& mark) override {
    if (!writes_) return;
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto known = mark.files.find(std::string(names[k]));
      const std::filesystem::path path = directory_ / names[k];
      if (known != mark.files.end())
        table_[k].emplace(path, known->second);
      else
        std::filesystem::remove(path);
    }
  }
  void mark(OutputMark& mark) override {
    for (std::size_t k = 0; k < names.size(); ++k)
      if (table_[k]) mark.files[std::string(names[k])] = table_[k]->sync();
  }

  /// All but steps.csv and walls.csv appear with their first line.
  void step(const StepRecord& record) override {
    append_steps_row(lines_of(steps), record.step);
    const bool line = context_.has_table_line(record.step.step);
    for (const WallReport& wall : record.walls)
      if (line) append_walls_row(lines_of(walls), record.step, wall);
    for (const BodyReport& body : record.bodies) append_bodies_row(lines_of(bodies), record.step, body);
    for (const InsertReport& insert : record.inserted)
      append_inserted_row(lines_of(inserted), record.step, insert);
    for (const RemoveReport& remove : record.removed)
      append_removed_row(lines_of(removed), record.step, remove);
    if (record.triaxial && line) append_triaxial_row(lines_of(triaxial), *record.triaxial);
    if (record.cell && line) append_cell_row(lines_of(cell), *record.cell);
    for (const ErrorCheck& check : record.errors)
      append_error_history_row(lines_of(errors), record.step.step, check);
  }

  void flush() override {
    for (std::optional<CsvFile>& table : table_)
      if (table) table->flush();
  }
  void close() override {
    for (std::optional<CsvFile>& table : table_)
      if (table) table->close();
  }

 private:
  std::string& lines_of(Table table) {
    if (!table_[table]) table_[table].emplace(directory_ / names[table], headers[table]());
    return table_[table]->pending();
  }

  OutputContext context_;
  std::filesystem::path directory_;
  bool writes_;
  std::array<std::optional<CsvFile>, tables> table_;
};

}  // namespace

const SinkKind table_sink{SinkUse::always,
                          [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
                            return std::make_unique<TableSink>(context);
                          },
                          [](const std::string& name) {
                            return name == "columns.json" ||
                                   std::find(names.begin(), names.end(), name) != names.end();
                          }};

}  // namespace talus::io
