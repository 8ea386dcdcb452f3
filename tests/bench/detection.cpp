/// Candidates of grains whose radii differ by up to 1 : 1, 10 and 100: time per grain of the grid and of the
/// pairs, and candidates per second beside those of equal grains. Every class of radii holds the same volume.
///
/// Usage: bench_detection [grains, default 200000] [runs, default 7]

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>
#include <vector>

#include "apps/shared/median.hpp"
#include "kernels/detection/broad_phase.hpp"

namespace {

using talus::Vec3;

struct Sample {
  std::vector<Vec3> x;
  std::vector<double> reach;  ///< radii and half of what candidates may be apart
};

/// Spheres at random places, from the largest on, in so much space that they fill 0.55 of it; one that meets
/// a sphere of an earlier batch tries again.
Sample packing(std::size_t grains, double ratio) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> radii(grains);
  double volume = 0;
  for (double& r : radii) {
    r = 1 / std::sqrt(1 + unit(random) * (1 / (ratio * ratio) - 1));
    volume += 4.0 / 3 * std::numbers::pi * r * r * r;
  }
  std::sort(radii.begin(), radii.end(), std::greater<>());
  const double edge = std::cbrt(volume / 0.55);
  Sample sample;
  talus::CellGrid before;
  for (std::size_t k = 0; k < grains; ++k) {
    if (k % (1 + k / 4) == 0) before = talus::build_cells(sample.x, sample.reach);
    Vec3 x;
    for (int attempt = 0; attempt < 50; ++attempt) {
      x = edge * Vec3(unit(random), unit(random), unit(random));
      if (before.cells.empty() || !talus::meets_any(before, x, 0.9 * radii[k])) break;
    }
    sample.x.push_back(x);
    sample.reach.push_back(radii[k] + 0.15 * radii[0] / ratio);
  }
  return sample;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

int main(int argc, char** argv) {
  const auto grains = static_cast<std::size_t>(argc > 1 ? std::atol(argv[1]) : 200000);
  const int runs = argc > 2 ? std::atoi(argv[2]) : 7;
  std::puts("ratio  candidates/grain  grid ns/grain  pairs ns/grain  candidates/s [10^6]  of equal grains'");
  double equal = 0;
  for (const double ratio : {1.0, 10.0, 100.0}) {
    const Sample sample = packing(grains, ratio);
    std::vector<double> grid_times, pair_times;
    std::size_t found = 0;
    for (int run = 0; run < runs; ++run) {
      auto start = std::chrono::steady_clock::now();
      const talus::CellGrid grid = talus::build_cells(sample.x, sample.reach);
      grid_times.push_back(seconds_since(start));
      start = std::chrono::steady_clock::now();
      std::vector<talus::GrainPair> pairs;
      talus::find_pairs(grid, 0, grid.cells.size(), pairs);
      pair_times.push_back(seconds_since(start));
      found = pairs.size();
    }
    const double grid = talus::median(grid_times), pairs = talus::median(pair_times);
    const double speed = static_cast<double>(found) / (grid + pairs), n = static_cast<double>(grains);
    if (equal == 0) equal = speed;
    std::printf("%5g  %16.2f  %13.0f  %14.0f  %19.1f  %16.2f\n", ratio, static_cast<double>(found) / n,
                1e9 * grid / n, 1e9 * pairs / n, speed / 1e6, speed / equal);
  }
}
