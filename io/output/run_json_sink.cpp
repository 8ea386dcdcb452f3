/// run.json: says "running" from the beginning, and what came of the run at its end.

#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"

namespace talus::io {
namespace {

class RunJsonSink : public OutputSink {
 public:
  explicit RunJsonSink(const OutputContext& context)
      : path_(context.directory / "run.json"),
        provenance_(context.provenance),
        begun_(context.begun),
        writes_(context.ranks.rank() == 0) {}

  void open() override {
    if (!writes_) return;
    write_run_json(path_, provenance_, begun_);
    // What came of the run must find room also when its results have filled the disk.
    constexpr std::int64_t generous = 1 << 14;
    reserve(path_, generous);
  }
  void end(const Summary& summary) override { write_run_json(path_, provenance_, summary); }

 private:
  std::filesystem::path path_;
  Provenance provenance_;
  Summary begun_;
  bool writes_;
};

}  // namespace

const SinkKind run_json_sink{SinkUse::always,
                             [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
                               return std::make_unique<RunJsonSink>(context);
                             },
                             [](const std::string& name) { return name == "run.json"; }};

}  // namespace talus::io
