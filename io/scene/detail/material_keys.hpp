#pragma once

#include <vector>

#include "io/scene/detail/scene_key.hpp"
#include "io/scene/scene.hpp"

namespace talus::io::detail {

/// Keys of the materials: the short form of one, several by name, what holds between two of them, and what a
/// stage changes of that.
Section<Scene> material_keys();
Section<MaterialSpec> named_material_keys();
Section<PairSpec> pair_keys();
Section<PairSpec> stage_pair_keys();

/// Friction and restitution of a stage, for scenes with one material.
std::vector<Key<Stage>> stage_law_keys();

/// The pairs of a table by the names of its materials, each with all its numbers.
std::vector<PairSpec> pairs_of(const PairTable& laws, const std::vector<MaterialSpec>& materials);

}  // namespace talus::io::detail
