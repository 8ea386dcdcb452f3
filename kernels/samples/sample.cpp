#include "kernels/samples/sample.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "kernels/samples/detail/random_numbers.hpp"

namespace talus {

using detail::jitter_draw;
using detail::turn_draw;
using detail::uniform_pair;

double mass(const Sample& sample, std::size_t k) {
  if (sample.shape.number == 0) return sphere_mass(sample.radius[k], sample.density_of(k));
  const double R = sample.radius[k];
  return sample.density_of(k) * sample.shape.volume * R * R * R;
}

std::array<double, 4> draw_orientation(std::uint64_t seed, std::uint64_t k) {
  std::uint32_t draw = turn_draw;
  struct Point {
    double x, y, square;
  };
  const auto in_disc = [&] {
    for (;;) {
      const auto [a, b] = uniform_pair(seed, k, draw++);
      const double x = 2 * a - 1, y = 2 * b - 1, square = x * x + y * y;
      if (square < 1 && square > 0) return Point{x, y, square};
    }
  };
  const Point one = in_disc(), other = in_disc();
  const double scale = std::sqrt((1 - one.square) / other.square);
  return {one.x, one.y, scale * other.x, scale * other.y};
}

void add_grain(Bodies& bodies, const Grain& grain, const GrainKind& kind) {
  const auto& [id, x, radius, density] = grain;
  if (kind.shape.number == 0) return add_sphere(bodies, id, x, radius, density, kind.rotates);
  const std::array<double, 4> turn = draw_orientation(kind.seed, static_cast<std::uint64_t>(id));
  add_unturning(bodies, id, {x, turn, radius, density}, kind.shape, kind.rotates);
}

void append(const Sample& sample, Bodies& bodies) {
  for (std::size_t k = 0; k < sample.size(); ++k) {
    add_grain(bodies, {sample.id_of(k), sample.x[k], sample.radius[k], sample.density_of(k)},
              {sample.shape, sample.seed, sample.rotates});
    if (!sample.material.empty()) bodies.material.push_back(sample.material[k]);
    if (sample.velocity.empty()) continue;
    const auto first = sample.velocity[k].begin();
    std::copy_n(first, 3, bodies.velocity.back().u);
    if (sample.rotates) std::copy_n(first + 3, 3, bodies.velocity.back().w);
  }
}

std::vector<Vec3> lattice(std::span<const double> radii, const Lattice& sites) {
  std::vector<Vec3> centres;
  if (radii.empty()) return centres;
  const double largest = *std::max_element(radii.begin(), radii.end());
  const double margin = largest + sites.jitter;  // from the walls to the first site
  if (!(sites.jitter >= 0 && sites.spacing >= 2 * margin * (1 - 1e-12)))
    throw std::invalid_argument("lattice: spacing must be at least 2 (largest radius + jitter) = " +
                                std::to_string(2 * margin) + " m, got " + std::to_string(sites.spacing));
  const bool hexagonal = sites.kind == Lattice::Kind::hexagonal;
  const double a = sites.spacing;
  const double row = hexagonal ? a * std::sqrt(0.75) : a;
  const double layer = hexagonal ? a * std::sqrt(2.0 / 3.0) : a;
  // Odd rows and layers of the hexagonal lattice are shifted; they must fit as well, so that all layers hold
  // equally many.
  const double room_x = sites.length_x - 2 * margin - (hexagonal ? a / 2 : 0);
  const double room_y = sites.length_y - 2 * margin - (hexagonal ? row / 3 : 0);
  if (!(room_x >= -1e-12 * a && room_y >= -1e-12 * a))
    throw std::invalid_argument("lattice: a base of " + std::to_string(sites.length_x) + " m x " +
                                std::to_string(sites.length_y) + " m has no room for one grain; widen it");
  const auto count = [](double room, double step) {
    return static_cast<std::size_t>(room / step + 1e-9) + 1;
  };
  const std::size_t nx = count(std::max(room_x, 0.0), a), ny = count(std::max(room_y, 0.0), row);

  centres.reserve(radii.size());
  const double reach =
      sites.jitter / std::sqrt(3.0);  // per axis, so that the displacement stays within the jitter
  for (std::size_t k = 0; k < radii.size(); ++k) {
    const std::size_t ix = k % nx, iy = k / nx % ny, iz = k / (nx * ny);
    Vec3 x(margin + static_cast<double>(ix) * a, margin + static_cast<double>(iy) * row,
           sites.bottom + margin + static_cast<double>(iz) * layer);
    if (hexagonal) {
      if ((iy + iz) % 2 == 1) x[0] += a / 2;
      if (iz % 2 == 1) x[1] += row / 3;
    }
    if (reach > 0) {
      const auto first = uniform_pair(sites.seed, k, jitter_draw),
                 second = uniform_pair(sites.seed, k, jitter_draw + 1);
      x += reach * Vec3(2 * first[0] - 1, 2 * first[1] - 1, 2 * second[0] - 1);
    }
    centres.push_back(x);
  }
  return centres;
}

std::vector<Vec3> lattice_in(const Region& region, double radius, double spacing, std::size_t most) {
  std::vector<Vec3> centres;
  if (!(spacing >= 2 * radius * (1 - 1e-12)))
    throw std::invalid_argument("lattice: spacing must be at least the largest diameter, " +
                                std::to_string(2 * radius) + " m, got " + std::to_string(spacing));
  const Bounds bounds = bounds_of(region);
  std::array<std::size_t, 3> sites{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double room = bounds.high[a] - bounds.low[a] - 2 * radius;
    if (room < 0) return centres;
    sites[axis] = static_cast<std::size_t>(room / spacing + 1e-9) + 1;
  }
  for (std::size_t iz = 0; iz < sites[2]; ++iz)
    for (std::size_t iy = 0; iy < sites[1]; ++iy)
      for (std::size_t ix = 0; ix < sites[0] && centres.size() < most; ++ix) {
        const Vec3 site(static_cast<double>(ix), static_cast<double>(iy), static_cast<double>(iz));
        const Vec3 x = bounds.low + Vec3::Constant(radius) + spacing * site;
        if (holds(region, x, radius * (1 - 1e-9))) centres.push_back(x);
      }
  return centres;
}

std::vector<Vec3> column(std::span<const double> radii, const Vec3& foot) {
  std::vector<Vec3> centres;
  centres.reserve(radii.size());
  double top = foot[2];
  for (double r : radii) {
    centres.emplace_back(foot[0], foot[1], top + r);
    top += 2 * r;
  }
  return centres;
}

}  // namespace talus
