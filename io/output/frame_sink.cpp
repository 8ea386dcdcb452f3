/// results.h5: the state at every output time (io/results/results.hpp).

#include "io/output/sinks.hpp"
#include "io/results/results.hpp"

namespace talus::io {
namespace {

class FrameSink : public OutputSink {
 public:
  explicit FrameSink(const OutputContext& context)
      : path_(context.directory / "results.h5"), ranks_(context.ranks), format_(context.format) {
    for (const Wall& wall : context.walls) {
      names_.walls.push_back(wall.name);
      names_.wall_materials.push_back(wall.material);
    }
    names_.materials = context.material_names;
    names_.clumps = !context.clumps.empty();
  }

  void open() override { results_.emplace(path_, names_, ranks_, format_); }
  void resume(const OutputMark& mark) override {
    results_.emplace(path_, names_, ranks_, format_, mark.frame_times.size());
  }
  void frame(const Frame& part) override { results_->append(part); }

 private:
  std::filesystem::path path_;
  ResultsNames names_;
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
