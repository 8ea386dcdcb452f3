/// probes.csv: a row for each probe whenever it reports. The file appears with the first one.

#include "io/output/sinks.hpp"
#include "io/results/csv_writer.hpp"
#include "io/results/probe_csv.hpp"

namespace talus::io {
namespace {

constexpr const char* probes_name = "probes.csv";

class ProbeSink : public OutputSink {
 public:
  explicit ProbeSink(const OutputContext& context)
      : path_(context.directory / probes_name),
        materials_(context.material_names),
        writes_(context.ranks.rank() == 0) {}

  void resume(const OutputMark& mark) override {
    if (!writes_) return;
    const auto known = mark.files.find(probes_name);
    if (known != mark.files.end())
      file_.emplace(path_, known->second);
    else
      std::filesystem::remove(path_);
  }
  void mark(OutputMark& mark) override {
    if (file_) mark.files[probes_name] = file_->sync();
  }
  void step(const StepRecord& record) override {
    for (const ProbeReport& report : record.probes) {
      if (!file_) file_.emplace(path_, probes_csv_header(materials_));
      append_probes_row(file_->pending(), record.step, report, materials_);
    }
  }
  void flush() override {
    if (file_) file_->flush();
  }
  void close() override {
    if (file_) file_->close();
  }

 private:
  std::filesystem::path path_;
  std::vector<std::string> materials_;
  bool writes_;
  std::optional<CsvFile> file_;
};

}  // namespace

const SinkKind probe_sink{SinkUse::always,
                          [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
                            return std::make_unique<ProbeSink>(context);
                          },
                          [](const std::string& name) { return name == probes_name; }};

}  // namespace talus::io
