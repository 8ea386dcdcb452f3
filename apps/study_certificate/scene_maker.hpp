#pragma once

/// Small scenes by the thousand: a family, and a seed that decides all else.

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::audit {

/// Uniform numbers from (seed, stream) by a counter (Random123, philox4x32): the same on every machine.
class Draws {
 public:
  Draws(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}

  double unit();  ///< in [0, 1)
  double between(double low, double high) { return low + (high - low) * unit(); }
  double between_decades(double low, double high);  ///< log-uniform, 0 < low <= high
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(unit() * static_cast<double>(n)); }
  int from_to(int low, int high);  ///< both included
  bool chance(double probability) { return unit() < probability; }
  Vec3 direction();  ///< evenly on the sphere

 private:
  std::uint64_t seed_, stream_;
  std::uint32_t drawn_ = 0;
};

/// A scene, its grains, and where both come from.
struct MadeScene {
  std::string family;
  std::uint64_t seed = 0;
  io::Scene scene;  ///< its sample is a file of bodies; io::place_walls is yet to be called
  Sample grains;

  std::string name() const { return family + "-" + std::to_string(seed); }
};

/// What the scenes of a study have in common.
struct MakerSettings {
  int steps = 20;           ///< in all; a change of loads comes in the middle
  int size = 1;             ///< grains, over those that the family has for the seed
  double tolerance = 1e-3;  ///< of solver.tolerance and solver.balance_tolerance alike
  int subdomains = 1;
  Coupling coupling = Coupling::alternating;
};

/// A family of scenes.
struct SceneFamily {
  std::string_view name, sentence;
  void (*make)(class SceneBench& bench);  ///< grains and walls
};
std::span<const SceneFamily> scene_families();

/// Scene of that seed. Throws std::invalid_argument when there is no such family.
MadeScene make_scene(std::string_view family, std::uint64_t seed, const MakerSettings& settings);

/// Writes the scene as NAME.toml, NAME being that of the scene, and its grains beside it, for `talus run`.
/// Throws io::FileError.
void keep_scene(const MadeScene& made, const std::filesystem::path& directory);

}  // namespace talus::audit
