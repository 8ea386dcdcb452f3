/// Time, memory, solid fraction and coordination of the layer-by-layer deposition. One CSV line per sample.
/// Usage: bench_deposition [largest sample, default 200000] [radius ratio, default 1.5]

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "kernels/samples/sample.hpp"

namespace {

/// Contacts of the grains with their centre in the bulk, a fifth of the sample away from floor, walls and
/// surface.
struct Bulk {
  double solid_fraction = 0;
  double coordination = 0;
};

Bulk measure(const std::vector<talus::Vec3>& x, const std::vector<double>& radii, double length) {
  std::vector<std::size_t> by_height(x.size());
  std::iota(by_height.begin(), by_height.end(), std::size_t{0});
  std::sort(by_height.begin(), by_height.end(),
            [&](std::size_t a, std::size_t b) { return x[a][2] < x[b][2]; });
  const double top = x[by_height.back()][2], largest = *std::max_element(radii.begin(), radii.end());
  const auto inside = [](double value, double size) { return value > 0.2 * size && value < 0.8 * size; };
  const auto in_bulk = [&](const talus::Vec3& c) {
    return inside(c[0], length) && inside(c[1], length) && inside(c[2], top);
  };
  double volume = 0;
  std::size_t grains = 0, ends = 0;
  for (std::size_t k = 0; k < by_height.size(); ++k) {
    const std::size_t a = by_height[k];
    const bool bulk = in_bulk(x[a]);
    if (bulk) {
      volume += 4.0 / 3 * M_PI * radii[a] * radii[a] * radii[a];
      ++grains;
    }
    for (std::size_t m = k + 1; m < by_height.size() && x[by_height[m]][2] - x[a][2] < 2.01 * largest; ++m) {
      const std::size_t b = by_height[m];
      const double distance = radii[a] + radii[b] + 1e-9 * largest;
      if ((x[a] - x[b]).squaredNorm() > distance * distance) continue;
      ends += bulk;
      ends += in_bulk(x[b]);
    }
  }
  return {volume / (0.216 * length * length * top), static_cast<double>(ends) / static_cast<double>(grains)};
}

}  // namespace

int main(int argc, char** argv) {
  const long most = argc > 1 ? std::atol(argv[1]) : 200000;
  const double ratio = argc > 2 ? std::atof(argv[2]) : 1.5;
  std::puts("grains,radius_ratio,seconds,us_per_grain,solid_fraction_bulk,coordination_bulk,peak_MB");
  for (const long n : {2000L, 16000L, 200000L}) {
    if (n > most) break;
    talus::SizeDistribution sizes{talus::SizeDistribution::Kind::uniform, 2 / (1 + ratio),
                                  2 * ratio / (1 + ratio)};
    const auto radii = talus::draw_radii(sizes, static_cast<std::size_t>(n), 1);
    const double length = 2 * std::cbrt(static_cast<double>(n) * 0.9);
    const auto begin = std::chrono::steady_clock::now();
    const auto centres = talus::deposit(radii, length, length);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();

    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const Bulk bulk = measure(centres, radii, length);
    std::printf("%ld,%g,%.2f,%.1f,%.4f,%.3f,%.0f\n", n, ratio, seconds,
                seconds / static_cast<double>(n) * 1e6, bulk.solid_fraction, bulk.coordination,
                static_cast<double>(usage.ru_maxrss) / 1024);
    std::fflush(stdout);
  }
}
