#include "kernels/samples/sample.hpp"

#include <Random123/philox.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace talus {

namespace {

/// Two uniform numbers in [0, 1) with 53 random bits each, from (seed, index, draw).
std::array<double, 2> uniform_pair(std::uint64_t seed, std::uint64_t index, std::uint32_t draw) {
  using Generator = r123::Philox4x32;
  const Generator::key_type key = {
      {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  const Generator::ctr_type counter = {
      {static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32), draw, 0}};
  const Generator::ctr_type word = Generator()(counter, key);
  const auto unit = [](std::uint64_t high, std::uint64_t low) {
    return static_cast<double>((high << 32 | low) >> 11) * 0x1p-53;
  };
  return {unit(word[0], word[1]), unit(word[2], word[3])};
}

// Streams of one seed: radii and displacements must not be correlated.
constexpr std::uint32_t radius_draw = 0;
constexpr std::uint32_t jitter_draw = 1;
constexpr std::uint32_t turn_draw = 3;  // and as many more as it takes

}  // namespace

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

std::vector<double> draw_radii(const SizeDistribution& sizes, std::size_t n, std::uint64_t seed) {
  using Kind = SizeDistribution::Kind;
  if (!(sizes.max > 0))
    throw std::invalid_argument("largest radius must be > 0 m, got " + std::to_string(sizes.max));
  if (sizes.kind == Kind::constant) return std::vector<double>(n, sizes.max);
  if (!(sizes.min > 0 && sizes.min <= sizes.max))
    throw std::invalid_argument("smallest radius must lie in (0, " + std::to_string(sizes.max) + "] m, got " +
                                std::to_string(sizes.min));
  std::vector<double> radii(n);
  const double low = 1 / (sizes.min * sizes.min), high = 1 / (sizes.max * sizes.max);
  for (std::size_t k = 0; k < n; ++k) {
    const double u = uniform_pair(seed, k, radius_draw)[0];
    // Inverse of the distribution function; for a density ~ r^-3 it is linear in r^-2.
    const double r = sizes.kind == Kind::uniform ? sizes.min + u * (sizes.max - sizes.min)
                                                 : 1 / std::sqrt(low - u * (low - high));
    radii[k] = std::clamp(r, sizes.min, sizes.max);
  }
  return radii;
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
