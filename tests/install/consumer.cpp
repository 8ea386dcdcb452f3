#include <cstdio>

#include "kernels/bodies/bodies.hpp"
#include "kernels/samples/sample.hpp"

int main() {
  talus::Bodies bodies;
  const auto radii = talus::draw_radii({talus::SizeDistribution::Kind::uniform, 0.9e-3, 1.1e-3}, 100, 1);
  const auto centres = talus::deposit(radii, 0.01, 0.01);
  for (std::size_t k = 0; k < radii.size(); ++k)
    talus::add_sphere(bodies, talus::BodyId{static_cast<std::int64_t>(k)}, centres[k], radii[k], 2600);
  std::printf("%zu grains, %.3g m^3\n", bodies.size(), talus::total_volume(bodies));
  return bodies.size() == 100 ? 0 : 1;
}
