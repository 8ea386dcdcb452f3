#include "apps/study_scaling/scaling_scenes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "apps/shared/placed_sample.hpp"
#include "apps/shared/sample_builder.hpp"
#include "io/files/output_directory.hpp"
#include "io/results/results.hpp"
#include "io/scene/bodies_file.hpp"

namespace talus {

namespace {

/// Drops the stages before `name`, whose loads stay on the walls, and puts its own on them: a wall that it
/// pushes has a velocity of its own before the first step.
void begin_with(io::Scene& scene, const std::string& name) {
  if (name.empty()) return;
  std::vector<Stage>& stages = scene.setup.stages;
  std::string known;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    if (stages[k].name != name) {
      known += (known.empty() ? "" : ", ") + stages[k].name;
      continue;
    }
    for (std::size_t to = 0; to <= k; ++to)
      for (const auto& [wall_name, load] : stages[to].loads)
        for (Wall& wall : scene.setup.walls)
          if (wall.name == wall_name) wall.load = load;
    stages.erase(stages.begin(), stages.begin() + static_cast<std::ptrdiff_t>(k));
    return;
  }
  throw std::invalid_argument(fmt::format("there is no stage '{}'; there are: {}", name, known));
}

Sample grains_of(const Frame& frame, const io::Scene& scene) {
  Sample sample;
  sample.density = scene.density;
  sample.rotates = scene.setup.rotation;
  sample.x = frame.x;
  sample.radius = frame.radius;
  for (const std::int64_t material : frame.material)
    sample.material.push_back(static_cast<Material>(material));
  put_materials(scene, sample);
  for (std::size_t k = 0; k < frame.x.size(); ++k) {
    sample.id.push_back(BodyId{frame.id[k]});
    const Vec3 spin = frame.omega.empty() ? Vec3(Vec3::Zero()) : Vec3(frame.radius[k] * frame.omega[k]);
    sample.velocity.push_back({frame.u[k][0], frame.u[k][1], frame.u[k][2], spin[0], spin[1], spin[2]});
  }
  return sample;
}

void put_walls(io::Scene& scene, const Frame& frame, const std::string& file) {
  for (Wall& wall : scene.setup.walls) {
    if (!wall.motion.empty())
      throw std::invalid_argument(
          fmt::format("wall '{}' moves by itself, and {} does not say how far it has come", wall.name, file));
    bool found = false;
    for (const WallReport& there : frame.walls)
      if (there.name == wall.name) {
        wall.point = there.position * wall.normal;
        wall.velocity = there.velocity * wall.normal;  // of one that is not pushed its load decides
        found = true;
      }
    if (!found)
      throw std::invalid_argument(
          fmt::format("{} has no wall '{}': it is not the results of this scene", file, wall.name));
  }
}

ScalingSample finished(io::Scene scene, Sample grains, const std::string& stage) {
  io::place_walls(scene, grains);
  begin_with(scene, stage);
  scene.setup.decomposition.boxes = {};  // runs have as many subdomains as the study says
  scene.output = io::OutputSpec{.directory = scene.output.directory,
                                .every = {},
                                .every_steps = {},
                                .stage_frames = false,
                                .contacts = false,
                                .sinks = {}};
  return {std::move(scene), std::move(grains)};
}

}  // namespace

ScalingSample scaling_sample(const std::string& path, const std::vector<std::string>& overrides,
                             const std::string& from, const std::string& stage) {
  io::Scene scene = io::load_scene(path, overrides);
  if (from.empty()) {
    Sample grains = place_sample(scene).sample;
    return finished(std::move(scene), std::move(grains), stage);
  }
  const std::size_t frames = io::frame_count(from);
  if (frames == 0) throw std::invalid_argument(from + " holds no frame");
  const Frame frame = io::read_frame(from, frames - 1);
  put_walls(scene, frame, from);
  const std::string first = stage.empty() ? scene.setup.stages.front().name : stage;
  return finished(std::move(scene), grains_of(frame, scene), first);
}

std::string range_of_radii(const Sample& grains) {
  const auto [smallest, largest] = std::ranges::minmax(grains.radius);
  return fmt::format("{:.4g} to {:.4g} m", smallest, largest);
}

std::string other_sample(const io::Scene& scene, const Sample& grains) {
  if (scene.samples.size() != 1) return "";
  const io::SampleSpec& spec = scene.samples.front();
  if (spec.from_file() || spec.grains() == 0) return "";
  if (const auto there = static_cast<std::int64_t>(grains.size()); there != spec.grains())
    return fmt::format("{} grains where the scene's sample has {}", there, spec.grains());
  const SizeDistribution& radii = spec.radii;
  const double least = smallest_radius(radii), most = largest_radius(radii);
  const auto [smallest, largest] = std::ranges::minmax(grains.radius);
  constexpr double rounding = 1e-9;
  if (smallest < least * (1 - rounding) || largest > most * (1 + rounding))
    return fmt::format("radii of {} where the scene's sample has {:.4g} to {:.4g} m", range_of_radii(grains),
                       least, most);
  return "";
}

std::string why_not_weak(const io::Scene& scene) {
  if (scene.samples.size() != 1) return "it has several samples";
  if (scene.samples.front().from_file()) return "its grains are read from a file";
  if (scene.samples.front().base[0] == 0) return "its grains stand on no base";
  for (const Wall& wall : scene.setup.walls)
    if (wall.point.allFinite())  // others wait for the grains
      return fmt::format("wall '{}' has a place of its own", wall.name);
  return "";
}

ScalingSample scaled_sample(const std::string& path, const std::vector<std::string>& overrides,
                            const std::string& stage, double part) {
  io::Scene scene = io::load_scene(path, overrides);
  if (const std::string why = why_not_weak(scene); !why.empty())
    throw std::invalid_argument(fmt::format("{}: the sample cannot grow, since {}", path, why));
  io::SampleSpec& spec = scene.samples.front();
  spec.count = std::max<std::int64_t>(1, std::llround(static_cast<double>(spec.count) * part));
  for (double& edge : spec.base) edge *= std::cbrt(part);
  Sample grains = build_sample(scene);
  return finished(std::move(scene), std::move(grains), stage);
}

void write_scaling_sample(const ScalingSample& sample, const std::filesystem::path& directory,
                          const std::string& stem) {
  io::Scene scene = sample.scene;
  io::SampleSpec spec;
  spec.kind = io::SampleSpec::Kind::bodies;
  spec.file = stem + ".csv";  // beside the scene
  io::write_bodies(directory / spec.file, sample.grains);
  scene.samples = {std::move(spec)};
  scene.setup.named.clear();
  io::write_whole(directory / (stem + ".toml"), io::resolved_scene(scene));
}

}  // namespace talus
