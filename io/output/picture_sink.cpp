/// forces.svg, velocities.svg and materials.svg of the newest frame, and triaxial.svg of the newest stage
/// that has such reports.

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/output/thinned_curve.hpp"
#include "io/pictures/picture.hpp"
#include "io/results/csv_reader.hpp"

namespace talus::io {
namespace {

class PictureSink : public OutputSink {
 public:
  explicit PictureSink(const OutputContext& context) : context_(context) {}

  /// The curve is in triaxial.csv, which is cut back already: every number reads back to the same bits.
  void resume(const OutputMark&) override {
    if (context_.ranks.rank() != 0) return;
    for (const TriaxialReport& report : read_triaxial(context_.directory / "triaxial.csv"))
      curve_.add(report);
  }
  void step(const StepRecord& record) override {
    if (record.triaxial && context_.has_table_line(record.step.step)) curve_.add(*record.triaxial);
  }
  void frame(const Frame& part) override {
    const SlabFrame slab = gather_slab(part, context_.ranks);
    if (context_.ranks.rank() == 0) draw_grain_pictures(slab);
    draw_triaxial_picture();
  }
  void close() override { draw_triaxial_picture(); }

 private:
  /// A box of fixed walls has stresses, but no curve.
  static bool is_strained(std::span<const TriaxialReport> rows, const TriaxialPicture& picture) {
    constexpr double least = 1e-6;
    return std::ranges::any_of(rows, [&](const TriaxialReport& row) {
      return row.stage == picture.stage &&
             std::abs(row.strain.at(static_cast<std::size_t>(picture.axis))) > least;
    });
  }

  void draw_grain_pictures(const SlabFrame& slab) {
    const auto& [all, sample] = slab;
    // The frame is in results.h5 already: that sink comes first.
    if (!shapes_)
      shapes_ = grain_shapes(context_.clumps, context_.inserts, context_.directory / "results.h5");
    if (all.with_contacts)
      write_whole(
          context_.directory / "forces.svg",
          draw_forces(all, context_.walls, {.load = context_.load, .sample = sample, .shapes = *shapes_}));
    const GrainPicture picture{.walls = context_.walls, .sample = sample, .shapes = *shapes_};
    write_whole(context_.directory / "velocities.svg", draw_velocities(all, picture));
    if (!all.material.empty())
      write_whole(context_.directory / "materials.svg",
                  draw_materials(all, context_.material_names, picture));
  }

  void draw_triaxial_picture() const {
    if (curve_.empty()) return;
    const std::vector<TriaxialReport> rows = curve_.rows();
    TriaxialPicture picture;
    picture.stage = rows.back().stage;
    if (const auto found = context_.axis_of_stage.find(picture.stage); found != context_.axis_of_stage.end())
      picture.axis = found->second;
    if (is_strained(rows, picture))
      write_whole(context_.directory / "triaxial.svg", draw_triaxial(rows, picture));
  }

  OutputContext context_;
  ThinnedCurve curve_;
  std::optional<GrainShapes> shapes_;  ///< once a frame was drawn
};

}  // namespace

const SinkKind picture_sink{SinkUse::by_default,
                            [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
                              return std::make_unique<PictureSink>(context);
                            },
                            [](const std::string& name) {
                              return name == "forces.svg" || name == "velocities.svg" ||
                                     name == "materials.svg" || name == "triaxial.svg";
                            }};

}  // namespace talus::io
