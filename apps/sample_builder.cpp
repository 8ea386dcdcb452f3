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

Sample build_sample(const io::Scene& scene) {
  const io::SampleSpec& spec = scene.sample;
  if (spec.kind == io::SampleSpec::Kind::bodies)
    return io::read_bodies(spec.file, scene.density, scene.setup.rotation);

  const auto count =
      static_cast<std::size_t>(spec.count > 0 ? spec.count : spec.cells[0] * spec.cells[1] * spec.cells[2]);
  Sample sample;
  sample.density = scene.density;
  sample.turns = scene.setup.rotation;
  sample.radius = draw_radii(spec.radii, count, scene.setup.seed);
  sample.x = spec.kind == io::SampleSpec::Kind::lattice ? lattice_sites(spec, sample.radius)
                                                        : deposit(sample.radius, spec.base[0], spec.base[1]);
  return sample;
}

}  // namespace talus
