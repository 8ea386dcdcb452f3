#pragma once

/// The scenes that a scaling study runs: the user's, with the grains in a file of their own, so that they are
/// laid down once and any machine can begin from them.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"

namespace talus {

/// A scene with its grains; walls are placed, nothing is written during runs.
struct ScalingSample {
  io::Scene scene;
  Sample grains;
};

/// The scene as it begins. `from`: a results.h5 whose last frame gives grains and walls, or "". `stage`: the
/// one to begin with, "" for the first; loads that stages before it changed are as these left them. Throws
/// io::SceneError, io::FileError, and std::invalid_argument for a stage that is not there and for a frame
/// whose walls are not those of the scene.
ScalingSample scaling_sample(const std::string& path, const std::vector<std::string>& overrides,
                             const std::string& from, const std::string& stage);

/// "0.008 to 0.012 m". There are grains.
std::string range_of_radii(const Sample& grains);

/// In what the grains are not those that the scene's sample asks for: their number, or a radius beyond its
/// range; "" when in neither, or where the sample is a file. There are grains.
std::string other_sample(const io::Scene& scene, const Sample& grains);

/// Why the sample cannot be made with fewer grains; "" when it can.
std::string why_not_weak(const io::Scene& scene);

/// The scene with `part` of its grains (0 < part <= 1), the edges of its base shortened as the cube root.
/// Throws what scaling_sample throws, and std::invalid_argument when the sample cannot be made so.
ScalingSample scaled_sample(const std::string& path, const std::vector<std::string>& overrides,
                            const std::string& stage, double part);

/// Writes STEM.toml and STEM.csv into `directory`; the former reads the latter. Throws io::FileError.
void write_scaling_sample(const ScalingSample& sample, const std::filesystem::path& directory,
                          const std::string& stem);

}  // namespace talus
