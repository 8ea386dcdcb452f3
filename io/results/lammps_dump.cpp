#include "io/results/lammps_dump.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace talus::io {
namespace {

/// Corners of the box around the grains [m]; zeros without any.
std::array<Vec3, 2> bounds(const Frame& frame) {
  if (frame.x.empty()) return {Vec3::Zero(), Vec3::Zero()};
  Vec3 low = frame.x[0], high = frame.x[0];
  for (std::size_t k = 0; k < frame.x.size(); ++k) {
    low = low.cwiseMin(frame.x[k] - Vec3::Constant(frame.radius[k]));
    high = high.cwiseMax(frame.x[k] + Vec3::Constant(frame.radius[k]));
  }
  return {low, high};
}

}  // namespace

std::string lammps_dump(const Frame& frame) {
  const auto [low, high] = bounds(frame);
  std::string text = fmt::format(
      "ITEM: UNITS\nsi\nITEM: TIME\n{}\nITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS ff "
      "ff ff\n",
      frame.time, frame.step, frame.id.size());
  const auto out = std::back_inserter(text);
  for (int axis = 0; axis < 3; ++axis) fmt::format_to(out, "{} {}\n", low[axis], high[axis]);
  text += "ITEM: ATOMS id type radius x y z vx vy vz";
  if (!frame.omega.empty()) text += " omegax omegay omegaz";
  if (!frame.orientation.empty()) text += " quatw quati quatj quatk";
  text += '\n';
  const auto put = [&](const Vec3& v) { fmt::format_to(out, " {} {} {}", v[0], v[1], v[2]); };
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    const std::int64_t material = frame.material.empty() ? 0 : frame.material[k];
    fmt::format_to(out, "{} {} {}", frame.id[k] + 1, material + 1, frame.radius[k]);
    put(frame.x[k]);
    put(frame.u[k]);
    if (!frame.omega.empty()) put(frame.omega[k]);
    if (!frame.orientation.empty())
      for (const double q : frame.orientation[k]) fmt::format_to(out, " {}", q);
    text += '\n';
  }
  return text;
}

}  // namespace talus::io
