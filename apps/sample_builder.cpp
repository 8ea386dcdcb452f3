#include "apps/sample_builder.hpp"

#include <algorithm>
#include <cmath>

#include "io/csv.hpp"
#include "kernels/sample.hpp"

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

}  // namespace

Bodies build_sample(const io::Scene& scene) {
  const io::SampleSpec& sample = scene.sample;
  if (sample.kind == io::SampleSpec::Kind::bodies)
    return io::read_bodies(sample.file, scene.density, scene.setup.rotation);

  const auto count = static_cast<std::size_t>(
      sample.count > 0 ? sample.count : sample.cells[0] * sample.cells[1] * sample.cells[2]);
  const std::vector<double> radii = draw_radii(sample.radii, count, scene.setup.seed);
  const std::vector<Vec3> centres = sample.kind == io::SampleSpec::Kind::lattice
                                        ? lattice_sites(sample, radii)
                                        : deposit(radii, sample.base[0], sample.base[1]);
  Bodies bodies;
  for (std::size_t k = 0; k < count; ++k)
    add_sphere(bodies, BodyId{static_cast<std::int64_t>(k)}, centres[k], radii[k], scene.density,
               scene.setup.rotation);
  return bodies;
}

}  // namespace talus
