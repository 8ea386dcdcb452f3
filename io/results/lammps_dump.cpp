#include "io/results/lammps_dump.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "io/results/cell_outline.hpp"
#include "io/results/wall_triangles.hpp"

namespace talus::io {
namespace {

/// The box around the grains, of 1 m without any; or the periodic cell: a leaning one by the box around it
/// and its tilts xy, xz, yz.
std::string box_of(const Frame& frame) {
  Bounds grains = grain_bounds(frame);
  if (frame.x.empty()) grains = {Vec3::Zero(), Vec3::Ones()};
  const CellBox box =
      cell_box(frame.domain, grains).value_or(CellBox{grains.low, (grains.high - grains.low).asDiagonal()});
  const double xy = box.edges(0, 1), xz = box.edges(0, 2), yz = box.edges(1, 2);
  const auto [back, ahead] = std::minmax({0.0, xy, xz, xy + xz});
  const Vec3 before(back, std::min(0.0, yz), 0), behind(ahead, std::max(0.0, yz), 0), tilts(xy, xz, yz);
  std::string text = box.leans() ? "ITEM: BOX BOUNDS xy xz yz" : "ITEM: BOX BOUNDS";
  for (const bool repeats : box.repeats) text += repeats ? " pp" : " ff";
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double low = box.low[axis], high = box.repeats[static_cast<std::size_t>(axis)]
                                                 ? low + box.edges(axis, axis)
                                                 : grains.high[axis];
    text += fmt::format("\n{} {}", low + before[axis], high + behind[axis]);
    if (box.leans()) text += fmt::format(" {}", tilts[axis]);
  }
  return text + '\n';
}

}  // namespace

std::string lammps_dump(const Frame& frame, std::size_t balls, const Frame& like) {
  std::string text =
      fmt::format("ITEM: UNITS\nsi\nITEM: TIME\n{}\nITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\n{}",
                  frame.time, frame.step, frame.id.size(), box_of(frame));
  const auto out = std::back_inserter(text);
  text += balls > 1 ? "ITEM: ATOMS id mol type" : "ITEM: ATOMS id type";
  text += " radius x y z";
  if (!like.u.empty()) text += " vx vy vz";
  if (!like.omega.empty()) text += " omegax omegay omegaz";
  if (!like.orientation.empty()) text += " quatw quati quatj quatk";
  text += '\n';
  const auto put = [&](const Vec3& v) { fmt::format_to(out, " {} {} {}", v[0], v[1], v[2]); };
  std::int64_t ball = 0;  // of its grain
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    const std::int64_t material = frame.material.empty() ? 0 : frame.material[k], grain = frame.id[k];
    ball = k > 0 && frame.id[k - 1] == grain ? ball + 1 : 0;
    fmt::format_to(out, "{}", grain * static_cast<std::int64_t>(balls) + ball + 1);
    if (balls > 1) fmt::format_to(out, " {}", grain + 1);
    fmt::format_to(out, " {} {}", material + 1, frame.radius[k]);
    put(frame.x[k]);
    if (!frame.u.empty()) put(frame.u[k]);
    if (!frame.omega.empty()) put(frame.omega[k]);
    if (!frame.orientation.empty())
      for (const double q : frame.orientation[k]) fmt::format_to(out, " {}", q);
    text += '\n';
  }
  return text;
}

}  // namespace talus::io
