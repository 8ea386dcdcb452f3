#pragma once

#include <string>

#include "io/scene/detail/scene_read.hpp"

namespace talus::io::detail {

/// Reads [material], or the [[material]]s and [[pair]]s, into Scene::density, materials and common.laws.
/// Throws SceneError.
void read_materials(const toml::table& root, Scene& scene);

/// What a stage changes of the laws: keys of the stage, which mean all pairs where materials have names, and
/// its [[stage.pair]]s. `stage.laws` are those of the scene before. `path` is that of the stage.
void read_stage_pairs(const toml::table& table, const std::string& path, const Scene& scene, Stage& stage);

/// The material that `table` names in its key `material`; the first of the scene where it names none.
Material read_material(const toml::table& table, const std::string& path, const Scene& scene,
                       Material otherwise);

}  // namespace talus::io::detail
