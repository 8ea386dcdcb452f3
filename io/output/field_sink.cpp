/// fields/ for ParaView: grains, forces, walls and the periodic cell of every frame, and the collections that
/// give them their times.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <system_error>

#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/results/grain_balls.hpp"
#include "io/results/vtk.hpp"
#include "io/results/wall_triangles.hpp"

namespace talus::io {
namespace {

constexpr std::array<std::string_view, 5> collections{"fields/grains.pvd", "fields/forces.pvd", "fields.pvd",
                                                      "fields/walls.pvd", "fields/cell.pvd"};

class FieldSink : public OutputSink {
 public:
  explicit FieldSink(const OutputContext& context)
      : directory_(context.directory),
        contacts_(context.contacts),
        walls_(context.walls),
        periodic_(context.periodic),
        clumps_(context.clumps),
        inserts_(context.inserts),
        ranks_(context.ranks) {
    for (const Wall& wall : walls_) wall_materials_.push_back(wall.material);
  }

  void open() override {
    if (ranks_.rank() != 0) return;
    std::error_code error;
    std::filesystem::create_directories(directory_ / "fields", error);
    if (error) throw FileError((directory_ / "fields").string(), "cannot be created: " + error.message());
  }

  void resume(const OutputMark& mark) override {
    open();
    for (const double time : mark.frame_times) note_frame(time, contacts_);
    if (ranks_.rank() != 0) return;
    // Where fields, or contacts, are asked for with the resumption, earlier frames have none.
    const auto missing = [&](const FieldFile& file) {
      return !std::filesystem::exists(directory_ / "fields" / file.path);
    };
    std::erase_if(grain_files_, missing);
    std::erase_if(force_files_, missing);
    std::erase_if(wall_files_, missing);
    std::erase_if(cell_files_, missing);
    std::error_code ignored;
    for (std::size_t later = frames_; remove_frame(later); ++later) {
    }
    for (const std::string_view name : collections) std::filesystem::remove(directory_ / name, ignored);
    if (frames_ > 0) write_collections();
  }

  void frame(const Frame& part) override {
    // The frame is in results.h5 already: that sink comes first.
    if (!shapes_) shapes_ = grain_shapes(clumps_, inserts_, directory_ / "results.h5", ranks_);
    write(grains_name(frames_), [&](const WriteText& out) {
      shapes_->clump ? write_grains_vtp(frame_of_balls(part, *shapes_), ranks_, out)
                     : write_grains_vtp(part, ranks_, out);
    });
    const bool forces = contacts_ && part.with_contacts;
    if (forces)
      write(forces_name(frames_), [&](const WriteText& out) { write_forces_vtp(part, ranks_, out); });
    if (!walls_.empty() || periodic_) write_surroundings(part, grain_bounds(part, ranks_));
    note_frame(part.time, forces);
    write_collections();
  }

 private:
  static std::string grains_name(std::size_t frame) { return fmt::format("grains_{:06}.vtp", frame); }
  static std::string walls_name(std::size_t frame) { return fmt::format("walls_{:06}.vtp", frame); }
  static std::string cell_name(std::size_t frame) { return fmt::format("cell_{:06}.vtp", frame); }
  static std::string forces_name(std::size_t frame) { return fmt::format("forces_{:06}.vtp", frame); }

  void note_frame(double time, bool forces) {
    grain_files_.push_back({time, 0, grains_name(frames_)});
    if (forces) force_files_.push_back({time, 0, forces_name(frames_)});
    if (!walls_.empty()) wall_files_.push_back({time, 0, walls_name(frames_)});
    if (periodic_) cell_files_.push_back({time, 0, cell_name(frames_)});
    ++frames_;
  }
  /// False where there is none of that number.
  bool remove_frame(std::size_t frame) const {
    std::error_code ignored;
    const bool grains = std::filesystem::remove(directory_ / "fields" / grains_name(frame), ignored);
    const bool forces = std::filesystem::remove(directory_ / "fields" / forces_name(frame), ignored);
    const bool walls = std::filesystem::remove(directory_ / "fields" / walls_name(frame), ignored);
    const bool cell = std::filesystem::remove(directory_ / "fields" / cell_name(frame), ignored);
    return grains || forces || walls || cell;
  }
  void write_collections() const {
    collect(collections[0], grain_files_);
    if (contacts_) collect(collections[1], force_files_);
    if (!walls_.empty()) collect(collections[3], wall_files_);
    if (periodic_) collect(collections[4], cell_files_);
    std::vector<FieldFile> all;
    for (const FieldFile& file : grain_files_) all.push_back({file.time, 0, "fields/" + file.path});
    for (const FieldFile& file : force_files_) all.push_back({file.time, 1, "fields/" + file.path});
    for (const FieldFile& file : wall_files_) all.push_back({file.time, 2, "fields/" + file.path});
    for (const FieldFile& file : cell_files_) all.push_back({file.time, 3, "fields/" + file.path});
    collect(collections[2], all);
  }

  /// Walls and cell, around the grains of all ranks.
  void write_surroundings(const Frame& part, const Bounds& grains) const {
    if (ranks_.rank() != 0) return;
    if (!walls_.empty())
      write_whole(directory_ / "fields" / walls_name(frames_),
                  walls_vtp(part, wall_triangles(walls_, part.walls, grains), wall_materials_));
    if (periodic_) write_whole(directory_ / "fields" / cell_name(frames_), cell_vtp(part, grains));
  }
  /// Made of the parts of all ranks; rank 0 writes.
  void write(const std::string& name, const std::function<void(const WriteText&)>& make) const {
    if (ranks_.rank() == 0)
      write_whole(directory_ / "fields" / name, make);
    else
      make([](std::string_view) {});
  }
  void collect(std::string_view name, const std::vector<FieldFile>& files) const {
    if (ranks_.rank() == 0) write_whole(directory_ / name, collection_pvd(files));
  }

  std::filesystem::path directory_;
  bool contacts_;
  std::vector<Wall> walls_;
  bool periodic_;
  std::vector<Clump> clumps_;
  bool inserts_;
  std::optional<GrainShapes> shapes_;  ///< once a frame was written
  std::vector<std::int64_t> wall_materials_;
  const graph::Communicator& ranks_;
  std::vector<FieldFile> grain_files_, force_files_, wall_files_, cell_files_;  ///< paths relative to fields/
  std::size_t frames_ = 0;
};

}  // namespace

const SinkKind field_sink{SinkUse::by_default,
                          [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
                            return std::make_unique<FieldSink>(context);
                          },
                          [](const std::string& name) {
                            return std::ranges::find(collections, name) != collections.end() ||
                                   is_numbered_name(name, "fields/grains_", ".vtp") ||
                                   is_numbered_name(name, "fields/forces_", ".vtp") ||
                                   is_numbered_name(name, "fields/walls_", ".vtp") ||
                                   is_numbered_name(name, "fields/cell_", ".vtp");
                          }};

}  // namespace talus::io
