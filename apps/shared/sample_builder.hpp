#pragma once

#include <string>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"

namespace talus {

/// The grains that a scene asks for, at rest unless its file gives velocities; ids 0..n-1, or those of the
/// file. Throws io::SceneError when the file is missing or damaged, or when a grain has no mass or speed that
/// is finite, std::invalid_argument when grains do not fit their base.
Sample build_sample(const io::Scene& scene);

/// A sample that was made otherwise, with the materials of the scene, and checked likewise.
Sample completed(const io::Scene& scene, Sample sample);

/// Where materials have names: gives the grains that have none that of the scene's sample, and all their
/// densities.
void put_materials(const io::Scene& scene, Sample& sample);

/// How many grains overlap others or walls (placed, io::place_walls) by more than a tenth of the smaller
/// radius, the worst of them, and what to do; "" when none does.
std::string describe_overlaps(const io::Scene& scene, const Sample& sample);

}  // namespace talus
