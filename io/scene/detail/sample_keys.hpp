#pragma once

#include <vector>

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

Section<SampleSpec> sample_keys();

/// Of the tables `region` of samples, insertions and removals.
Section<Region> region_keys();

/// Keys of a distribution of radii.
std::vector<Key<SizeDistribution>> radius_keys();

}  // namespace talus::io::detail
