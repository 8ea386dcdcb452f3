#pragma once

/// How two scenes differ: whether a run may go on under the other one.

#include <filesystem>
#include <string>
#include <vector>

#include "io/scene/scene.hpp"

namespace talus::io {

struct SceneChange {
  std::string key;      ///< as --set names it, "stage.shear.end.strain"
  std::string was, is;  ///< as TOML; "" where there is none
  /// What a run that goes on may get anew: ends and loads of stages, loads of walls, output, checkpoints,
  /// what changes no bit (instruction set, mapping), and what is said of the scene.
  bool allowed = false;
};

/// Keys that differ between two texts of resolved_scene, in order of their names.
std::vector<SceneChange> scene_changes(const std::string& was, const std::string& is);

/// Whether it moves the end of a stage.
bool moves_an_end(const SceneChange& change);

/// "stage.shear.friction was 0.35 and is 0.5".
std::string describe(const SceneChange& change);

/// Absolute paths of the files that a scene reads, but for the state that its sample was: that is as large as
/// a checkpoint itself, and not needed any more.
std::vector<std::string> input_files(const Scene& scene);
/// The same, and that state.
std::vector<std::filesystem::path> files_read(const Scene& scene);

}  // namespace talus::io
