#pragma once

/// What a scene may hold that is no mistake, and is seldom meant.

#include <string>
#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"

namespace talus {

/// Sentences without a full stop: no walls, gravity that points up or away from every wall, materials lighter
/// than foam or heavier than any element, rolling resistance without friction, walls whose tables jump within
/// a step, more subdomains than grains, grains that overlap (describe_overlaps). `scene` with its walls
/// placed.
std::vector<std::string> scene_warnings(const io::Scene& scene, const Sample& sample);

}  // namespace talus
