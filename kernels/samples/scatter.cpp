#include "kernels/samples/scatter.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <string>

#include "kernels/samples/detail/random_numbers.hpp"

namespace talus {

namespace {

/// Grains that are in place, and their images beside the box, in cells that two spheres fit across.
class PlacedGrains {
 public:
  PlacedGrains(const ScatterBox& box, double largest) : box_(box), reach_(2 * largest) {
    const Vec3 extent = box.high - box.low + Vec3::Constant(2 * reach_);
    for (std::size_t axis = 0; axis < 3; ++axis)
      count_[axis] = static_cast<std::size_t>(
          std::clamp(extent[static_cast<Eigen::Index>(axis)] / reach_, 1.0, most_cells_an_axis));
    size_ = extent.cwiseQuotient(
        Vec3(static_cast<double>(count_[0]), static_cast<double>(count_[1]), static_cast<double>(count_[2])));
    cells_.resize(count_[0] * count_[1] * count_[2]);
  }

  bool overlaps(const Vec3& x, double radius) const {
    std::array<std::size_t, 3> low{}, high{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t cell = cell_along(axis, x);
      low[axis] = cell > 0 ? cell - 1 : 0;
      high[axis] = std::min(cell + 1, count_[axis] - 1);
    }
    for (std::size_t i = low[0]; i <= high[0]; ++i)
      for (std::size_t j = low[1]; j <= high[1]; ++j)
        for (std::size_t k = low[2]; k <= high[2]; ++k)
          for (const Ball& ball : cells_[place(i, j, k)]) {
            const double touching = ball.radius + radius;
            if ((ball.x - x).squaredNorm() < touching * touching) return true;
          }
    return false;
  }

  void add(const Vec3& x, double radius) {
    box_.domain.each_image(x, reach_, [&](const Vec3&, const Vec3& image) {
      cells_[place(cell_along(0, image), cell_along(1, image), cell_along(2, image))].push_back(
          {image, radius});
    });
  }

 private:
  static constexpr double most_cells_an_axis = 512;
  struct Ball {
    Vec3 x;
    double radius;
  };
  std::size_t place(std::size_t i, std::size_t j, std::size_t k) const {
    return i + count_[0] * (j + count_[1] * k);
  }
  std::size_t cell_along(std::size_t axis, const Vec3& x) const {
    const auto a = static_cast<Eigen::Index>(axis);
    const double at = (x[a] - box_.low[a] + reach_) / size_[a];
    return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(count_[axis] - 1)));
  }

  const ScatterBox& box_;
  double reach_;
  std::array<std::size_t, 3> count_{};
  Vec3 size_;
  std::vector<std::vector<Ball>> cells_;
};

/// Try `attempt` of grain k.
Vec3 place_of(const ScatterBox& box, double radius, std::size_t k, std::uint32_t attempt) {
  const std::uint32_t draw = detail::place_draw + 2 * attempt;
  const auto a = detail::uniform_pair(box.seed, k, draw, box.stream),
             b = detail::uniform_pair(box.seed, k, draw + 1, box.stream);
  const Vec3 share(a[0], a[1], b[0]);
  Vec3 x;
  for (const Eigen::Index axis : {0, 1, 2}) {
    const double margin = box.domain.edges()[axis] > 0 ? 0 : radius;
    x[axis] = box.low[axis] + margin + share[axis] * (box.high[axis] - box.low[axis] - 2 * margin);
  }
  return x;
}

}  // namespace

std::vector<Vec3> scatter(std::span<const double> radii, const ScatterBox& box, const StandingGrains& stand) {
  std::vector<Vec3> centres(radii.size());
  if (radii.empty()) return centres;
  constexpr std::uint32_t most_tries = 10000;
  std::vector<std::size_t> order(radii.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](std::size_t k) { return radii[k]; });
  double largest = radii[order[0]];
  for (const double radius : stand.radius) largest = std::max(largest, radius);
  PlacedGrains placed(box, largest);
  for (std::size_t k = 0; k < stand.x.size(); ++k) placed.add(box.domain.wrap(stand.x[k]), stand.radius[k]);
  std::size_t done = 0;
  for (const std::size_t k : order) {
    std::uint32_t attempt = 0;
    do {
      if (attempt == most_tries)
        throw std::invalid_argument(
            "random sample: no room for a grain of radius " + std::to_string(radii[k]) + " m after " +
            std::to_string(done) + " of " + std::to_string(radii.size()) +
            "; make the space larger, or count smaller" +
            (stand.x.empty() ? "" : ", or put this sample before those of smaller grains"));
      centres[k] = place_of(box, radii[k], k, attempt++);
    } while (placed.overlaps(centres[k], radii[k]));
    placed.add(centres[k], radii[k]);
    ++done;
  }
  return centres;
}

}  // namespace talus
