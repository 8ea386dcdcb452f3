#include "apps/shared/scene_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/shared/sample_builder.hpp"

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
    else if (g.norm() > 0 && !scene.setup.walls.empty() &&
             std::ranges::none_of(scene.setup.walls,
                                  [&](const Wall& wall) { return stands_against(wall, g); }))
      warnings.push_back(where + ", and no wall stands against it: the grains fall for ever");
  }
}

}  // namespace

std::vector<std::string> scene_warnings(const io::Scene& scene, const Sample& sample) {
  std::vector<std::string> warnings;
  if (scene.setup.walls.empty()) warnings.push_back("the scene has no walls: nothing holds the grains");
  add_gravity(scene, warnings);
  if (scene.materials.empty()) add_density("the material", scene.density, warnings);
  for (const io::MaterialSpec& material : scene.materials)
    add_density(fmt::format("material '{}'", material.name), material.density, warnings);
  if (std::string overlaps = describe_overlaps(scene, sample); !overlaps.empty())
    warnings.push_back(std::move(overlaps));
  return warnings;
}

}  // namespace talus
