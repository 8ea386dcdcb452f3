#include "apps/commands/view_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "apps/report/run_folder.hpp"
#include "apps/shared/child_process.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "io/files/error.hpp"
#include "io/files/output_directory.hpp"
#include "io/pictures/view.hpp"
#include "io/results/results.hpp"
#include "io/results/wall_triangles.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

/// 0, 1, 2. Throws std::invalid_argument.
int axis_of(const std::string& name) {
  if (name.size() != 1 || name[0] < 'x' || name[0] > 'z')
    throw std::invalid_argument(fmt::format("--slice is '{}': x, y or z", name));
  return name[0] - 'x';
}

/// A slice is seen along its axis unless something else is asked for; x, or y of a slice across x, to the
/// right.
io::Camera camera_of(const ViewCommandOptions& options) {
  static constexpr std::array<io::Camera, 3> along{{{0, 0}, {-90, 0}, {-90, 90}}};
  io::Camera camera;
  if (!options.slice.empty()) camera = along[static_cast<std::size_t>(axis_of(options.slice))];
  camera = {options.azimuth.value_or(camera.azimuth), options.elevation.value_or(camera.elevation)};
  if (!std::isfinite(camera.azimuth) || !std::isfinite(camera.elevation))
    throw std::invalid_argument(
        fmt::format("--azimuth {:g} and --elevation {:g}: give finite angles, in degrees", camera.azimuth,
                    camera.elevation));
  return camera;
}

/// The frames of a run and how they are to be seen. Throws std::exception where options mean nothing.
class Viewed {
 public:
  explicit Viewed(const ViewCommandOptions& options) : results_(fs::path(options.run) / "results.h5") {
    const RunFolder run = read_run_folder(options.run);
    if (run.scene) {
      const Setup& setup = run.scene->setup;
      walls_ = setup.walls, materials_ = setup.material_names;
      view_.shapes = io::grain_shapes(setup.clumps, !setup.inserts.empty(), results_);
    }
    view_.colour = io::grain_colours().named(options.colour).kind;
    view_.camera = camera_of(options);
    if (!options.slice.empty()) view_.slice = axis_of(options.slice);
    view_.width = static_cast<std::size_t>(options.width);
    if (!fs::exists(results_))
      throw std::invalid_argument(fmt::format("{}: no results.h5 of a run there", options.run));
    frames_ = io::demand_frames(results_);
  }

  std::size_t frames() const { return frames_; }
  std::vector<std::vector<Triangle>> triangles(const Frame& frame) const {
    return io::wall_triangles(walls_, frame.walls, io::grain_bounds(frame));
  }
  /// With what its colours are made of.
  Frame frame(std::size_t k) const {
    using enum io::GrainColour;
    const bool forces = view_.colour == force,
               speeds = view_.colour == speed || io::velocity_axis(view_.colour);
    return io::read_frame(results_, k,
                          forces   ? io::FrameParts::forces
                          : speeds ? io::FrameParts::without_contacts
                                   : io::FrameParts::places);
  }
  /// Throws std::invalid_argument where frame k was written without what its colours are made of. In a film
  /// such frames show no forces.
  void demand_colours(std::size_t k) const {
    if (view_.colour == io::GrainColour::force && !frame(k).with_contacts)
      throw std::invalid_argument(
          fmt::format("{}: frame {} was written without its contacts, for the scene says output.contacts = "
                      "false, or output.contacts_every leaves them out; choose another --colour or --frame",
                      results_.string(), k));
  }

  /// One scale and one place for all frames. A frame at rest, or without forces, has no scale of its own.
  void fit() {
    Bounds box;
    std::optional<io::ColourRange> range;
    bool first = true;
    for (std::size_t k = 0; k < frames_; ++k) {
      const Frame each = frame(k);
      const std::vector<double> values = io::grain_values(each, view_.colour);
      if (values.empty()) continue;
      const Bounds of_frame = io::view_bounds(each, triangles(each));
      const io::ColourRange colours = io::colour_range(values, view_.colour);
      box = first ? of_frame : Bounds{box.low.cwiseMin(of_frame.low), box.high.cwiseMax(of_frame.high)};
      first = false;
      const bool shows = io::velocity_axis(view_.colour)
                             ? std::ranges::any_of(values, [](double value) { return value != 0; })
                             : std::ranges::max(values) > 0;
      if (!shows) continue;
      range = range ? io::ColourRange{std::min(range->low, colours.low), std::max(range->high, colours.high)}
                    : colours;
    }
    if (first) return;
    view_.box = box;
    view_.range = range.value_or(io::colour_range(std::vector<double>{0}, view_.colour));
  }

  std::string image(std::size_t k) const {
    const Frame shown = frame(k);
    return io::png_bytes(io::render_view(shown, walls_, triangles(shown), view_));
  }
  std::string picture(std::size_t k) const { return io::draw_view(frame(k), walls_, view_, materials_); }
  std::string scale() const {
    return view_.range ? fmt::format("{} from {:.3g} to {:.3g}", io::label_of(view_.colour), view_.range->low,
                                     view_.range->high)
                       : io::label_of(view_.colour);
  }

 private:
  fs::path results_;
  std::vector<Wall> walls_;
  std::vector<std::string> materials_;
  io::ViewOptions view_;
  std::size_t frames_ = 0;
};

int refuse(const std::exception& error, int code) {
  print_error("talus: error: {}\n", error.what());
  return code;
}

std::string image_name(std::size_t frame) {
  return fmt::format("frame_{:06}.png", frame);
}

/// Throws io::FileError where the images cannot be meant to be written.
void check_images(const std::vector<fs::path>& images, const fs::path& out,
                  const ViewCommandOptions& options) {
  fs::path above = fs::absolute(out);
  while (!fs::exists(above)) above = above.parent_path();
  if (!fs::is_directory(above))
    throw io::FileError(above.string(), "is a file, not a folder; give another name with --out");
  if (fs::exists(out)) io::check_output_files(sources_in(options.run), images, options.force);
}

void make_folder(const fs::path& out) {
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw io::FileError(out.string(), "cannot make this folder: " + error.message());
}

/// Pages of a film have even edges. Says what it could not do: images are there without it.
void join_images(const fs::path& out, const ViewCommandOptions& options) {
  if (!program_exists("ffmpeg")) {
    print_error("talus: there is no ffmpeg here; it would join the images to a film\n");
    return;
  }
  const fs::path log = out / "ffmpeg.log";
  const int code = run_child(
      {"ffmpeg", "-y", "-framerate", std::to_string(options.rate), "-i", (out / "frame_%06d.png").string(),
       "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", (out / "movie.mp4").string()},
      log);
  if (code == 0)
    print_error("talus: {} written\n", (out / "movie.mp4").string());
  else
    print_error("talus: warning: ffmpeg ended with {}; {} says why\n", code, log.string());
}

}  // namespace

int view_command(const ViewCommandOptions& options) {
  const fs::path out = options.out.empty() ? fs::path(options.run) / "view.png" : fs::path(options.out);
  std::string image;
  try {
    if (out.extension() != ".svg" && out.extension() != ".png")
      throw std::invalid_argument(fmt::format("--out {}: a view is a .png or a .svg", out.string()));
    const Viewed viewed(options);
    const int frames = static_cast<int>(viewed.frames());
    const int k = options.frame < 0 ? frames + options.frame : options.frame;
    if (k < 0 || k >= frames)
      throw std::invalid_argument(fmt::format("--frame is {}, there are {} frames", options.frame, frames));
    io::check_output_files(sources_in(options.run), {out}, options.force);
    const auto which = static_cast<std::size_t>(k);
    viewed.demand_colours(which);
    image = out.extension() == ".svg" ? viewed.picture(which) : viewed.image(which);
  } catch (const std::exception& error) {
    return refuse(error, exit_bad_input);
  }
  try {
    io::write_whole(out, image);
  } catch (const std::exception& error) {
    return refuse(error, exit_failure);
  }
  print_error("talus: {} written\n", out.string());
  return exit_done;
}

int movie_command(const ViewCommandOptions& options) {
  const fs::path out = options.out.empty() ? fs::path(options.run) / "movie" : fs::path(options.out);
  std::optional<Viewed> viewed;
  std::vector<fs::path> images{out / "movie.mp4"};
  try {
    viewed.emplace(options);
    for (std::size_t k = 0; k < viewed->frames(); ++k) images.push_back(out / image_name(k));
    check_images(images, out, options);
    viewed->fit();
  } catch (const std::exception& error) {
    return refuse(error, exit_bad_input);
  }
  try {
    make_folder(out);
    for (std::size_t k = 0; k < viewed->frames(); ++k) io::write_whole(images[k + 1], viewed->image(k));
    print_error("talus: {} images in {}, coloured by {}\n", viewed->frames(), out.string(), viewed->scale());
    join_images(out, options);
  } catch (const std::exception& error) {
    return refuse(error, exit_failure);
  }
  return exit_done;
}

}  // namespace talus
