#include "apps/shared/sample_builder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "apps/shared/patience.hpp"
#include "apps/shared/state_sample.hpp"
#include "io/scene/bodies_file.hpp"
#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/samples/sample.hpp"

namespace talus {

namespace {

std::vector<Vec3> lattice_sites(const io::SampleSpec& sample, const std::vector<double>& radii) {
  const double spacing = sample.spacing * 2 * *std::max_element(radii.begin(), radii.end());
  Lattice sites;
  sites.spacing = spacing;
  sites.length_x = sample.cells[0] > 0 ? static_cast<double>(sample.cells[0]) * spacing : sample.base[0];
  sites.length_y = sample.cells[1] > 0 ? static_cast<double>(sample.cells[1]) * spacing : sample.base[1];
  return lattice(radii, sites);
}

/// Throws SceneError when this process cannot hold the grains that it is to make.
void demand_memory(const io::Scene& scene, double grains) {
  // What a grain takes while it is deposited, and all in all with its contacts (docs/performance.md).
  constexpr double bytes_made = 100, bytes_run = 1160;
  const double there =
      static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  if (grains * bytes_made > there)
    throw io::SceneError(
        scene.source_file, 0, "sample",
        fmt::format("{:.3g} grains take about {:.3g} GB to make and {:.3g} GB to run; this "
                    "machine has {:.3g} GB. Ask for fewer",
                    grains, grains * bytes_made / 1e9, grains * bytes_run / 1e9, there / 1e9));
}

Sample make_sample(const io::Scene& scene) {
  const io::SampleSpec& spec = scene.sample;
  if (spec.kind == io::SampleSpec::Kind::bodies)
    return io::read_bodies(spec.file, scene.density, scene.setup.rotation, scene.materials);
  if (spec.kind == io::SampleSpec::Kind::state) return read_state(scene).sample;

  demand_memory(scene, static_cast<double>(spec.grains()));
  Sample sample;
  sample.density = scene.density;
  sample.rotates = scene.setup.rotation;
  if (!scene.setup.clumps.empty()) sample.shape = mass_of(1, scene.setup.clumps.front());
  sample.seed = scene.setup.seed;
  sample.radius = draw_radii(spec.radii, static_cast<std::size_t>(spec.grains()), scene.setup.seed);
  if (spec.kind == io::SampleSpec::Kind::lattice) {
    sample.x = lattice_sites(spec, sample.radius);
    return sample;
  }
  Patience patience;
  sample.x = deposit(sample.radius, spec.base[0], spec.base[1], [&](std::size_t placed) {
    patience.tell([&] { return fmt::format("{} of {} grains deposited", placed, sample.radius.size()); });
  });
  return sample;
}

/// What Simulation would refuse (validate of Bodies), while the file that says it is at hand.
void check(const io::Scene& scene, const Sample& sample) {
  const std::string& file = scene.sample.from_file() ? scene.sample.file : scene.source_file;
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const auto refuse = [&](const std::string& what) {
      throw io::SceneError(file, 0, "",
                           fmt::format("body {}: {}", static_cast<std::int64_t>(sample.id_of(k)), what));
    };
    if (const double m = mass(sample, k); !mass_is_sound(m))
      refuse(fmt::format(
          "a radius of {} m with a density of {} kg/m^3 makes a mass of {} kg, which must lie in {} to {}; "
          "give lengths in m and densities in kg/m^3",
          sample.radius[k], sample.density_of(k), m, least_mass, most_mass));
    if (!sample.velocity.empty() &&
        !std::ranges::all_of(sample.velocity[k], [](double v) { return std::isfinite(v); }))
      refuse("radius times angular velocity is not finite");
  }
}

/// By how much a sphere overlaps a wall [m]; 0 or less where it does not.
double depth_at(const Wall& wall, const Vec3& x, double radius) {
  if (wall.surface() == nullptr) return radius - wall_point(wall, x, 0, Domain{}).distance;
  std::vector<SurfacePoint> points;
  wall.surface()->collide(x, radius, points);
  double depth = 0;
  for (const SurfacePoint& point : points) depth = std::max(depth, radius - point.distance);
  return depth;
}

struct Overlaps {
  std::size_t count = 0;
  double worst = 0.1;  ///< depth over the smaller radius; less is none
  std::string between;

  void add(double depth, double radius, const auto& describe) {
    if (depth <= 0.1 * radius) return;
    ++count;
    if (depth <= worst * radius) return;
    worst = depth / radius;
    between = describe();
  }
};

}  // namespace

void put_materials(const io::Scene& scene, Sample& sample) {
  if (scene.materials.empty()) return;
  for (const io::MaterialSpec& material : scene.materials)
    sample.material_density.push_back(material.density);
  if (!sample.material.empty()) return;
  const auto named = std::ranges::find(scene.materials, scene.sample.material, &io::MaterialSpec::name);
  const auto of_all = named == scene.materials.end() ? 0 : named - scene.materials.begin();
  sample.material.assign(sample.size(), static_cast<Material>(of_all));
}

Sample build_sample(const io::Scene& scene) {
  return completed(scene, make_sample(scene));
}

Sample completed(const io::Scene& scene, Sample sample) {
  put_materials(scene, sample);
  check(scene, sample);
  return sample;
}

std::string describe_overlaps(const io::Scene& scene, const Sample& sample) {
  Overlaps overlaps;
  const auto id = [&](std::size_t k) { return static_cast<std::int64_t>(sample.id_of(k)); };
  // Samples that are made have none between grains.
  if (scene.sample.from_file()) {
    const CellGrid grid = build_cells(sample.x, sample.radius);
    std::vector<GrainPair> pairs;
    find_pairs(grid, 0, grid.cells.size(), pairs);
    for (const GrainPair& pair : pairs) {
      const auto a = static_cast<std::size_t>(pair.first), b = static_cast<std::size_t>(pair.second);
      overlaps.add(sample.radius[a] + sample.radius[b] - Domain{}.separation(sample.x[a], sample.x[b]).norm(),
                   std::min(sample.radius[a], sample.radius[b]),
                   [&] { return fmt::format("grains {} and {}", id(a), id(b)); });
    }
  }
  for (const Wall& wall : scene.setup.walls)
    for (std::size_t k = 0; stands_at_first(scene.setup, wall) && k < sample.size(); ++k)
      overlaps.add(depth_at(wall, sample.x[k], sample.radius[k]), sample.radius[k],
                   [&] { return fmt::format("grain {} and wall '{}'", id(k), wall.name); });
  if (overlaps.count == 0) return "";
  return fmt::format(
      "{} overlap{} of more than 10 % of the smaller radius, the deepest of {:.0f} % between {}; {}",
      overlaps.count, overlaps.count == 1 ? "" : "s", 100 * overlaps.worst, overlaps.between,
      scene.setup.solver.overlap_correction > 0
          ? "solver.overlap_correction parts them"
          : "they stay as they are: set solver.overlap_correction to 0.1, or begin from another sample");
}

}  // namespace talus
