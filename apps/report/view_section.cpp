/// The sample in space: as it was last written, and to be turned by hand where it is not too large.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/report/sections.hpp"
#include "apps/report/view_script.hpp"
#include "io/files/detail/with_unit.hpp"
#include "io/pictures/detail/chart_style.hpp"
#include "io/pictures/view.hpp"
#include "io/results/detail/base64.hpp"
#include "io/results/results.hpp"
#include "io/results/wall_triangles.hpp"

namespace talus {

namespace {

using nlohmann::json;

constexpr std::size_t most_live = 20000;     ///< spheres that a browser turns smoothly
constexpr std::size_t most_drawn = 1000000;  ///< that a report draws by itself
constexpr std::size_t most_bends = 5000;     ///< of a wall: a finer mesh has no outline in the live view

/// The newest frame; none where there is none, or it lacks what a view needs.
std::optional<Frame> last_frame(const RunFolder& run) {
  try {
    const std::filesystem::path results = run.directory / "results.h5";
    const std::size_t frames = std::filesystem::exists(results) ? io::frame_count(results) : 0;
    const auto count = [&](const char* key) {
      const auto found = run.summary.find(key);
      return found != run.summary.end() && found->is_number_unsigned() ? found->get<std::size_t>() : 0;
    };
    const std::size_t grains = std::max(count("bodies"), count("bodies_at_end"));
    if (frames == 0 || grains > most_drawn) return std::nullopt;
    // Forces are shown by the live view only.
    return io::read_frame(results, frames - 1,
                          grains > most_live ? io::FrameParts::without_contacts : io::FrameParts::all);
  } catch (const std::exception&) {
    return std::nullopt;  // a frame of which parts were left out, or one that is being written
  }
}

std::array<int, 3> bytes_of(const std::array<double, 3>& colour) {
  std::array<int, 3> bytes{};
  for (std::size_t c = 0; c < 3; ++c) bytes[c] = static_cast<int>(std::lround(255 * colour[c]));
  return bytes;
}

/// A way to colour the grains: what its scale says, and a byte for each grain.
struct Colouring {
  json words;
  std::vector<std::uint8_t> values;
};

Colouring colouring(const Frame& frame, io::GrainColour colour, const std::vector<std::string>& materials) {
  const std::vector<double> values = io::grain_values(frame, colour);
  const io::ColourRange range = io::colour_range(values, colour);
  Colouring result;
  const bool by_material = colour == io::GrainColour::material;
  json palette = json::array();
  constexpr int tones = 24;
  const int entries = by_material ? static_cast<int>(io::detail::hues.size()) : tones;
  for (int k = 0; k < entries; ++k)
    palette.push_back(bytes_of(io::colour_of(
        by_material ? k : range.low + k * (range.high - range.low) / (entries - 1), range, colour)));
  std::string text = fmt::format("{:.3g} to {:.3g}", range.low, range.high);
  if (by_material) {
    text.clear();
    for (const std::string& name : materials) text += (text.empty() ? "" : ", ") + name;
  }
  result.words = {
      {"name", io::label_of(colour)}, {"materials", by_material}, {"palette", palette}, {"text", text}};
  for (const double value : values) {
    const double part = std::clamp((value - range.low) / (range.high - range.low), 0.0, 1.0);
    result.values.push_back(static_cast<std::uint8_t>(std::lround(by_material ? value : 255 * part)));
  }
  return result;
}

/// What the script reads. Lengths are over the longest edge of the box; places from its lower corner, for
/// lines of walls from its middle. Behind the ends of a bend stand its normals.
json live_data(const Frame& frame, const io::GrainShapes& shapes,
               const std::vector<std::vector<Triangle>>& walls, const std::vector<std::string>& materials) {
  const Bounds box = io::view_bounds(frame, walls);
  const Vec3 size = box.high - box.low;
  const double longest = size.maxCoeff();
  std::vector<Colouring> colours;
  for (const io::GrainColour colour :
       {io::GrainColour::speed, io::GrainColour::radius, io::GrainColour::force})
    colours.push_back(colouring(frame, colour, materials));
  if (!frame.material.empty()) colours.push_back(colouring(frame, io::GrainColour::material, materials));
  std::vector<std::uint8_t> bytes;
  const auto put = [&](double part) {
    const auto number = static_cast<unsigned>(std::lround(65535 * std::clamp(part, 0.0, 1.0)));
    bytes.push_back(static_cast<std::uint8_t>(number & 0xff));
    bytes.push_back(static_cast<std::uint8_t>(number >> 8));
  };
  for (const auto& [centre, radius, grain] : io::seen_balls(frame, shapes)) {
    for (int axis = 0; axis < 3; ++axis) put((centre[axis] - box.low[axis]) / longest);
    put(radius / longest);
    for (const Colouring& colour : colours) bytes.push_back(colour.values[grain]);
  }
  const Vec3 middle = (box.low + box.high) / 2;
  json lines = json::array(), bends = json::array(), words = json::array();
  const auto rounded = [&](double length) { return std::round(1e5 * length / longest) / 1e5; };
  const auto line_of = [&](const std::array<Vec3, 2>& ends) {
    json line = json::array();
    for (const Vec3& end : ends)
      for (int axis = 0; axis < 3; ++axis) line.push_back(rounded(end[axis] - middle[axis]));
    return line;
  };
  for (const std::vector<Triangle>& wall : walls) {
    for (const auto& ends : io::edges_of(wall)) lines.push_back(line_of(ends));
    const std::vector<io::Bend> round = io::bends_of(wall);
    if (round.size() > most_bends) continue;
    for (const io::Bend& bend : round) {
      json line = line_of(bend.ends);
      for (const Vec3& normal : bend.normals)
        for (int axis = 0; axis < 3; ++axis) line.push_back(std::round(1e4 * normal[axis]) / 1e4);
      bends.push_back(std::move(line));
    }
  }
  for (const io::CellLine& line : io::lines_of_cell(frame)) lines.push_back(line_of(line.ends));
  for (const Colouring& colour : colours) words.push_back(colour.words);
  const io::Camera camera;
  return {{"grains", io::detail::base64_of(std::as_bytes(std::span(bytes)))},
          {"size", {size.x() / longest, size.y() / longest, size.z() / longest}},
          {"colours", words},
          {"walls", lines},
          {"bends", bends},
          {"azimuth", camera.azimuth},
          {"elevation", camera.elevation}};
}

std::string live_view(const json& data) {
  return "<div class=\"live\" hidden><canvas tabindex=\"0\" aria-label=\"The sample; arrow keys turn it, + "
         "and - change its size\"></canvas>\n<p><label>coloured by <select></select></label> <span "
         "class=\"bar\"></span><span class=\"scale\"></span></p>\n"
         "<script type=\"application/json\" class=\"grains\">" +
         data.dump() + "</script>\n<script>" + view_script + "</script></div>\n";
}

}  // namespace

HtmlSections view_section(const RunFolder& run) {
  const auto status = run.summary.find("status");
  const bool ended = status != run.summary.end() && *status != "running";
  if (const std::string damage = damage_of_frames(run.directory); ended && !damage.empty())
    return {{"The sample", "No picture: " + damage + "."}};
  const std::optional<Frame> frame = last_frame(run);
  if (!frame || frame->id.empty()) return {};
  std::vector<Wall> walls;
  std::vector<std::string> materials;
  io::GrainShapes shapes;
  if (run.scene) {
    const Setup& setup = run.scene->setup;
    walls = setup.walls, materials = setup.material_names;
    shapes = io::grain_shapes(setup.clumps, !setup.inserts.empty(), run.directory / "results.h5");
  }
  const std::size_t balls = shapes.clump ? shapes.clump->balls.size() : 1;
  const bool live = frame->id.size() * balls <= most_live;
  io::HtmlSection section{
      "The sample", fmt::format("The newest of its frames, at {}.{}", io::detail::with_unit(frame->time, "s"),
                                live ? " Drag, or use the arrow keys, to turn it." : "")};
  io::HtmlFigure figure{.svg = io::draw_view(*frame, walls, {.shapes = shapes}, materials),
                        .caption = "",
                        .keeps_colours = true};
  if (live)
    figure.live = live_view(live_data(
        *frame, shapes, io::wall_triangles(walls, frame->walls, io::grain_bounds(*frame)), materials));
  section.figures.push_back(std::move(figure));
  return {section};
}

}  // namespace talus
