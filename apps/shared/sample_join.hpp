#pragma once

#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"

namespace talus {

/// The samples of a scene as one, each behind those before; ids that a part does not have of its own follow
/// the largest so far. Parts have the materials of the scene, if it has any. Throws io::SceneError naming two
/// samples whose grains overlap or have the same id.
Sample join_samples(const io::Scene& scene, std::vector<Sample> parts);

}  // namespace talus
