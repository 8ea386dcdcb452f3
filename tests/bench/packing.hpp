#pragma once

/// Dense packings for the benchmarks.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>

#include "kernels/bodies/bodies.hpp"

namespace talus::bench {

struct Packing {
  double edge = 0;
  Bodies bodies;
};

inline Packing read_packing(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot open " + path);
  Packing packing;
  std::string line, word;
  std::getline(file, line);
  std::istringstream first(line);
  if (!(first >> word >> word >> packing.edge)) throw std::runtime_error(path + ":1: expected `# L <edge>`");
  std::getline(file, line);
  for (int number = 3; std::getline(file, line); ++number) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream values(line);
    double x, y, z, r;
    if (!(values >> x >> y >> z >> r))
      throw std::runtime_error(fmt::format("{}:{}: expected x,y,z,r", path, number));
    add_sphere(packing.bodies, BodyId{number - 3}, Vec3(x, y, z), r, 1.0);
  }
  return packing;
}

/// Hexagonal close packing of spacing 2 with jitter, radii 0.95-1.05, resting on the floor: about 7 contacts
/// a grain within 0.02.
inline Packing make_packing(int grains = 16000) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> jitter(-0.05, 0.05);
  const int side = static_cast<int>(std::cbrt(grains));
  Packing packing;
  for (int k = 0; k < grains; ++k) {
    const int i = k % side, j = k / side % side, l = k / (side * side);
    const double x = 2 * i + (j + l) % 2 + 1, y = std::sqrt(3.0) * (j + l % 2 / 3.0) + 1,
                 z = 2 * std::sqrt(6.0) / 3 * l + 1;
    add_sphere(packing.bodies, BodyId{k}, Vec3(x + jitter(random), y + jitter(random), z + jitter(random)),
               1 + jitter(random), 1.0);
    packing.edge = std::max({packing.edge, x + 1, y + 1, z + 1});
  }
  return packing;
}

}  // namespace talus::bench
