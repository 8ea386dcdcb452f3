/// fields/field_NAME_*.vti for ParaView: the coarse-grained fields of every frame, and the collections that
/// give them their times.

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/output/sinks.hpp"
#include "io/results/vti.hpp"
#include "io/results/vtk.hpp"

namespace talus::io {
namespace {

class GridSink : public OutputSink {
 public:
  explicit GridSink(const OutputContext& context)
      : directory_(context.directory / "fields"), names_(context.grids), writes_(context.ranks.rank() == 0) {}

  void open() override {
    if (!writes_ || names_.empty()) return;
    std::error_code error;
    std::filesystem::create_directories(directory_, error);
    if (error) throw FileError(directory_.string(), "cannot be created: " + error.message());
  }
  void resume(const OutputMark& mark) override {
    open();
    frames_ = mark.frame_times.size();
    if (!writes_ || names_.empty()) return;
    std::error_code ignored;
    for (std::size_t frame = 0; frame < frames_; ++frame)
      if (std::filesystem::exists(file_of(names_.front(), frame), ignored))
        written_.push_back({frame, mark.frame_times[frame]});
    for (const std::string& name : names_) {
      for (std::size_t later = frames_; std::filesystem::remove(file_of(name, later), ignored); ++later) {
      }
      std::filesystem::remove(collection_of(name), ignored);
      if (!written_.empty()) collect(name);
    }
  }
  void frame(const Frame& part) override {
    const std::size_t number = frames_++;
    if (!writes_ || part.grids.empty()) return;
    written_.push_back({number, part.time});
    for (const FieldGrid& field : part.grids) {
      write_whole(file_of(field.name, number),
                  [&](const WriteText& out) { write_field_vti(field, part.time, out); });
      collect(field.name);
    }
  }

 private:
  /// A frame that has fields.
  struct Written {
    std::size_t frame;
    double time;  ///< [s]
  };
  static std::string file_name(const std::string& field, std::size_t frame) {
    return fmt::format("field_{}_{:06}.vti", field, frame);
  }
  std::filesystem::path file_of(const std::string& field, std::size_t frame) const {
    return directory_ / file_name(field, frame);
  }
  std::filesystem::path collection_of(const std::string& field) const {
    return directory_ / fmt::format("field_{}.pvd", field);
  }
  void collect(const std::string& field) const {
    std::vector<FieldFile> files;
    for (const auto& [frame, time] : written_) files.push_back({time, 0, file_name(field, frame)});
    write_whole(collection_of(field), collection_pvd(files));
  }

  std::filesystem::path directory_;
  std::vector<std::string> names_;
  bool writes_;
  std::vector<Written> written_;
  std::size_t frames_ = 0;  ///< of the run, those without fields among them
};

}  // namespace

const SinkKind grid_sink{SinkUse::always,
                         [](const OutputContext& context) -> std::unique_ptr<OutputSink> {
                           return std::make_unique<GridSink>(context);
                         },
                         [](const std::string& name) {
                           return name.starts_with("fields/field_") && std::ranges::count(name, '/') == 1 &&
                                  (name.ends_with(".vti") || name.ends_with(".pvd"));
                         }};

}  // namespace talus::io
