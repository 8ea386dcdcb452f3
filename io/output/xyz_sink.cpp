/// frames.xyz: grains of every frame as extended XYZ text, which OVITO, VMD and ASE read.

#include <fmt/format.h>

#include <array>

#include "io/output/sinks.hpp"
#include "io/results/cell_outline.hpp"
#include "io/results/csv_writer.hpp"
#include "io/results/wall_triangles.hpp"

namespace talus::io {
namespace {

/// A line of the file.
struct GrainLine {
  std::int64_t id;
  std::array<double, 3> x;  ///< [m]
  double radius;            ///< [m]
  std::array<double, 3> u;  ///< [m/s]
};

/// Of a periodic cell its edges, where it stands, and which of them repeat.
std::string lattice_text(const std::optional<CellBox>& cell) {
  if (!cell) return "";
  const auto& h = cell->edges;
  const auto flag = [&](std::size_t axis) { return cell->repeats[axis] ? 'T' : 'F'; };
  return fmt::format("Lattice=\"{} 0 0 {} {} 0 {} {} {}\" Origin=\"{} {} {}\" pbc=\"{} {} {}\" ", h(0, 0),
                     h(0, 1), h(1, 1), h(0, 2), h(1, 2), h(2, 2), cell->low[0], cell->low[1], cell->low[2],
                     flag(0), flag(1), flag(2));
}

class XyzSink : public OutputSink {
 public:
  explicit XyzSink(const OutputContext& context)
      : path_(context.directory / "frames.xyz"), ranks_(context.ranks) {}

  void open() override {
    if (ranks_.rank() == 0) file_.emplace(path_, "");
  }

  /// The number of grains, what the columns are, and a line for each grain, in the order of their ids.
  void frame(const Frame& part) override {
    std::vector<GrainLine> lines;
    for (std::size_t k = 0; k < part.id.size(); ++k)
      lines.push_back({part.id[k],
                       {part.x[k][0], part.x[k][1], part.x[k][2]},
                       part.radius[k],
                       {part.u[k][0], part.u[k][1], part.u[k][2]}});
    std::int64_t grains[1] = {static_cast<std::int64_t>(lines.size())};
    ranks_.sum(grains);
    const std::string lattice =
        part.domain.repeats ? lattice_text(cell_box(part.domain, grain_bounds(part, ranks_))) : "";
    if (file_)
      file_->pending() += fmt::format("{}\n{}Properties=id:I:1:pos:R:3:radius:R:1:velo:R:3 Time={} Step={}\n",
                                      grains[0], lattice, part.time, part.step);
    ranks_.records_to_first(std::span<const GrainLine>(lines), [&](std::span<const GrainLine> piece) {
      for (const auto& [id, x, radius, u] : piece)
        file_->pending() +=
            fmt::format("{} {} {} {} {} {} {} {}\n", id, x[0], x[1], x[2], radius, u[0], u[1], u[2]);
      file_->flush();
    });
    if (file_) file_->flush();
  }

  void resume(const OutputMark& mark) override {
    const auto known = mark.files.find("frames.xyz");
    if (known == mark.files.end()) return open();  // asked for with the resumption
    if (ranks_.rank() == 0) file_.emplace(path_, known->second);
  }
  void mark(OutputMark& mark) override { mark.files["frames.xyz"] = file_->sync(); }
  void close() override { file_->close(); }

 private:
  std::filesystem::path path_;
  const graph::Communicator& ranks_;
  std::optional<CsvFile> file_;  ///< on rank 0
};

}  // namespace

const SinkKind xyz_sink{SinkUse::on_request,
                        [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
                          return std::make_unique<XyzSink>(context);
                        },
                        [](const std::string& name) { return name == "frames.xyz"; }};

}  // namespace talus::io
