/// results.h5: the state at every output time (io/results/results.hpp).

#include "io/output/sinks.hpp"
#include "io/results/results.hpp"

namespace talus::io {
namespace {

class FrameSink : public OutputSink {
 public:
  explicit FrameSink(const OutputContext& context)
      : path_(context.directory / "results.h5"), ranks_(context.ranks), format_(context.format) {
    for (const Wall& wall : context.walls) wall_names_.push_back(wall.name);
  }

  void open() override { results_.emplace(path_, wall_names_, ranks_, format_); }
  void resume(const OutputMark& mark) override {
    results_.emplace(path_, wall_names_, ranks_, format_, mark.frame_times.size());
  }
  void frame(const Frame& part) override { results_->append(part); }

 private:
  std::filesystem::path path_;
  std::vector<std::string> wall_names_;
  const graph::Communicator& ranks_;
  FrameFormat format_;
  std::optional<ResultsWriter> results_;
};

}  // namespace

const SinkKind frame_sink{
    SinkUse::always,
    [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
      return std::make_unique<FrameSink>(context);
    },
    [](const std::string& name) { return name == "results.h5" || name == "results.h5.undo"; }};

}  // namespace talus::io
