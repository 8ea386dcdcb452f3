#include "apps/shared/scene_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "apps/shared/sample_builder.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/samples/detail/random_numbers.hpp"
#include "kernels/shapes/region.hpp"

namespace talus {

namespace {

/// Densities of what grains are made of [kg/m^3]: foam of polystyrene has 15 to 30, osmium 22,600.
constexpr double lightest = 30, heaviest = 23000;

void add_density(const std::string& where, double density, std::vector<std::string>& warnings) {
  if (density < lightest)
    warnings.push_back(
        fmt::format("{} has a density of {:g} kg/m^3, less than foam; {:g} g/cm^3 are {:g} kg/m^3", where,
                    density, density, 1000 * density));
  if (density > heaviest)
    warnings.push_back(fmt::format("{} has a density of {:g} kg/m^3, more than any element", where, density));
}

/// Surfaces may stand anywhere.
bool stands_against(const Wall& wall, const Vec3& gravity) {
  return wall.surface() != nullptr || wall.normal.dot(gravity) < 0;
}

void add_gravity(const io::Scene& scene, std::vector<std::string>& warnings) {
  for (const Stage& stage : scene.setup.stages) {
    const Vec3& g = stage.gravity;
    const std::string where =
        fmt::format("gravity of stage '{}' is ({:g}, {:g}, {:g}) m/s^2", stage.name, g[0], g[1], g[2]);
    if (g[2] > 0)
      warnings.push_back(where + ", upwards: z points up");
    else if (g.norm() > 0 && (!scene.setup.walls.empty() || scene.setup.domain.repeats) &&
             std::ranges::none_of(scene.setup.walls,
                                  [&](const Wall& wall) { return stands_against(wall, g); }))
      warnings.push_back(where + ", and no wall stands against it: the grains fall for ever");
  }
}

/// Nothing can come where walls are.
void add_regions(const io::Scene& scene, std::vector<std::string>& warnings) {
  constexpr std::uint64_t probes = 256;
  for (const InsertRule& rule : scene.setup.inserts) {
    const double radius = smallest_radius(rule.radii);
    bool free = false;
    for (std::uint64_t k = 0; k < probes && !free; ++k) {
      const auto [a, b] = detail::uniform_pair(1, k, 0);
      const Place place = place_in(rule.region, radius, {a, b, detail::uniform_pair(1, k, 1)[0]});
      free = place.found && std::ranges::none_of(scene.setup.walls, [&](const Wall& wall) {
               return meets_wall(wall, place.x, radius);
             });
    }
    if (!free)
      warnings.push_back(fmt::format(
          "the region of insert '{}' lies in or behind walls: no grain will find room there", rule.name));
  }
}

/// A deposition fills pores with small grains, far below the place where they would have come to rest.
void add_segregation(const io::Scene& scene, const Sample& sample, std::vector<std::string>& warnings) {
  constexpr double sorted = 1.5;  // mean radii, highest over lowest fifth; radii of 1 : 5 give 2.0
  if (scene.samples.size() != 1 || scene.samples.front().kind != io::SampleSpec::Kind::deposition) return;
  const std::size_t fifth = sample.size() / 5;
  if (fifth < 20) return;
  std::vector<std::size_t> by_height(sample.size());
  std::iota(by_height.begin(), by_height.end(), std::size_t{0});
  std::ranges::sort(by_height, {}, [&](std::size_t k) { return sample.x[k][2]; });
  double low = 0, high = 0;
  for (std::size_t k = 0; k < fifth; ++k) {
    low += sample.radius[by_height[k]] / static_cast<double>(fifth);
    high += sample.radius[by_height[sample.size() - 1 - k]] / static_cast<double>(fifth);
  }
  if (high > sorted * low)
    warnings.push_back(
        fmt::format("the deposition is sorted by size: the mean radius of the lowest fifth of the grains is "
                    "{:.3g} m, of the highest {:.3g} m. Let such sizes rain instead, with an [[insert]]",
                    low, high));
}

}  // namespace

std::vector<std::string> scene_warnings(const io::Scene& scene, const Sample& sample) {
  std::vector<std::string> warnings;
  if (scene.setup.walls.empty() && scene.setup.domain.edges().minCoeff() == 0)
    warnings.push_back("the scene has no walls: nothing holds the grains");
  add_gravity(scene, warnings);
  add_regions(scene, warnings);
  add_segregation(scene, sample, warnings);
  if (scene.materials.empty()) add_density("the material", scene.density, warnings);
  for (const io::MaterialSpec& material : scene.materials)
    add_density(fmt::format("material '{}'", material.name), material.density, warnings);
  if (std::string overlaps = describe_overlaps(scene, sample); !overlaps.empty())
    warnings.push_back(std::move(overlaps));
  return warnings;
}

}  // namespace talus
