#include "apps/shared/state_sample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <string>

#include "io/checkpoint/checkpoint_file.hpp"
#include "io/checkpoint/checkpoint_folder.hpp"
#include "io/files/error.hpp"
#include "io/results/results.hpp"
#include "runtime/step/cell_flow.hpp"

namespace talus {

namespace {

void add_body(std::int64_t id, const Vec3& x, double radius, const Vec3& u, const Vec3& w, Sample& to) {
  to.id.push_back(BodyId{id});
  to.x.push_back(x);
  to.radius.push_back(radius);
  to.velocity.push_back({u[0], u[1], u[2], w[0], w[1], w[2]});
}

/// -1 - number in the scene of wall number -1 - `second` of the run; 0 where it has no such wall.
std::int64_t wall_in(const io::Scene& scene, std::int64_t second, const std::vector<WallReport>& walls) {
  const std::string& name = walls.at(static_cast<std::size_t>(-1 - second)).name;
  const auto found = std::ranges::find(scene.setup.walls, name, &Wall::name);
  return found == scene.setup.walls.end() ? 0 : -1 - (found - scene.setup.walls.begin());
}

StateSample state_of_frame(const io::Scene& scene) {
  const io::SampleSpec& spec = scene.samples.front();
  const std::string& file = spec.file;
  const std::size_t frames = io::frame_count(file);
  const Frame frame = io::read_frame(
      file, spec.frame ? static_cast<std::size_t>(*spec.frame) : std::max<std::size_t>(frames, 1) - 1);
  StateSample state;
  state.walls = frame.walls;
  state.clumps = io::holds_clumps(file);
  state.domain = frame.domain;
  state.materials = io::material_names(file);
  for (std::size_t k = 0; k < frame.id.size(); ++k)
    add_body(frame.id[k], frame.x[k], frame.radius[k], frame.u[k],
             frame.omega.empty() ? Vec3(Vec3::Zero()) : Vec3(frame.radius[k] * frame.omega[k]), state.sample);
  for (const std::int64_t material : frame.material)
    state.sample.material.push_back(static_cast<Material>(material));
  for (std::size_t k = 0; k < frame.contact_bodies.size(); ++k) {
    GivenForce force{frame.contact_bodies[k][0], frame.contact_bodies[k][1]};
    if (force.second < 0) {
      force.second = wall_in(scene, force.second, frame.walls);
      if (force.second == 0) continue;
    }
    std::copy_n(frame.contact_force[k].data(), 3, force.force);
    std::copy_n(frame.contact_normal[k].data(), 3, force.normal);
    state.forces.push_back(force);
  }
  return state;
}

/// Candidates of a part with an impulse, as forces between ids.
void add_forces(const io::Scene& scene, const io::CheckpointFile& file, const CheckpointPart& part,
                StateSample& state) {
  const auto length = static_cast<std::size_t>(file.state.head.impulse_kind);
  const auto centre = [&](std::int32_t slot) {
    const auto& x = part.x.at(static_cast<std::size_t>(slot));
    return Vec3(x[0], x[1], x[2]);
  };
  const auto id = [&](std::int32_t slot) { return part.id.at(static_cast<std::size_t>(slot)); };
  std::size_t grain = 0, at_wall = 0, candidate = 0, number = 0;
  for (const auto& [candidates, wall, side, contacts] : part.chunks)
    for (std::int32_t k = 0; k < candidates; ++k) {
      const bool acts = part.acts.at(candidate++) != 0;
      GivenForce force;
      Vec3 normal = Vec3::UnitZ();
      if (wall < 0) {
        const auto& [first, second] = part.grain_pairs.at(grain++);
        force = {id(first), id(second)};
        normal = state.domain.separation(centre(first), centre(second)).normalized();
      } else {
        const auto& [of, body, feature] = part.wall_pairs.at(at_wall++);
        force = {id(body), wall_in(scene, -1 - of, state.walls), feature};
        if (force.second < 0) normal = scene.setup.walls[static_cast<std::size_t>(-1 - force.second)].normal;
      }
      if (!acts) continue;
      const double* row = &part.impulses.at(number);
      number += length;
      if (wall >= 0 && force.second == 0) continue;
      for (Eigen::Index c = 0; c < 3; ++c) {
        const auto at = static_cast<std::size_t>(c);
        force.normal[at] = normal[c];
        force.force[at] = (length == 1 ? row[0] * normal[c] : row[at]) / file.state.head.impulse_time;
      }
      state.forces.push_back(force);
    }
}

StateSample state_of_checkpoint(const io::Scene& scene) {
  const std::string& path = scene.samples.front().file;
  const io::CheckpointFile file = io::read_checkpoint_head(path);
  const CheckpointHead& head = file.state.head;
  StateSample state;
  // Names are in the scene that the run had.
  const auto resolved = file.texts.find("scene.resolved.toml");
  const io::Scene before =
      io::parse_scene(resolved == file.texts.end() ? "" : resolved->second, path + ": scene");
  for (std::size_t w = 0; w < before.setup.walls.size(); ++w) {
    const Wall& wall = before.setup.walls[w];
    const Vec3 point(&head.wall_points.at(3 * w)), velocity(&head.wall_velocities.at(3 * w));
    state.walls.push_back({wall.name, wall.normal.dot(point), wall.normal.dot(velocity), Vec3::Zero()});
    state.walls.back().pose.moved = wall.surface() != nullptr && !wall.motion.empty();
  }
  state.domain = before.setup.domain;
  state.clumps = !before.setup.clumps.empty();
  for (const io::MaterialSpec& material : before.materials) state.materials.push_back(material.name);
  restore_cell(head, state.domain);
  std::vector<std::int32_t> subdomains(static_cast<std::size_t>(head.subdomains));
  std::iota(subdomains.begin(), subdomains.end(), 0);
  for (const CheckpointPart& part : io::read_checkpoint_parts(path, subdomains)) {
    for (std::size_t k = 0; k < part.id.size(); ++k) {
      if (!part.counts.empty() && part.counts[k] == 0) continue;
      const auto& v = part.velocity[k];
      add_body(part.id[k], Vec3(part.x[k].data()), part.radius[k], {v[0], v[1], v[2]}, {v[4], v[5], v[6]},
               state.sample);
      if (!part.material.empty()) state.sample.material.push_back(part.material[k]);
    }
    add_forces(scene, file, part, state);
  }
  return state;
}

/// Edges and shears of a cell as a scene writes them.
std::string words_of(const Domain& domain) {
  if (!domain.repeats) return "no [cell]";
  const PeriodicSpace& c = domain.cell;
  return fmt::format("[cell] lengths = [{}, {}, {}], shears = [{}, {}, {}], origin = [{}, {}, {}]", c.xx,
                     c.yy, c.zz, c.xy, c.xz, c.yz, domain.low[0], domain.low[1], domain.low[2]);
}

/// But for what writing numbers down may lose.
bool same_cell(const Domain& a, const Domain& b) {
  const double small = 1e-9 * edges_of(a).cwiseAbs().maxCoeff();
  return a.repeats == b.repeats && (edges_of(a) - edges_of(b)).cwiseAbs().maxCoeff() <= small &&
         (!a.repeats || (a.low - b.low).cwiseAbs().maxCoeff() <= small);
}

/// Materials of the scene for those of the same name; or what the scene lacks.
std::string name_materials(const io::Scene& scene, const std::vector<std::string>& names, Sample& sample) {
  if (scene.materials.empty()) {
    const bool alike =
        std::ranges::adjacent_find(sample.material, std::not_equal_to()) == sample.material.end();
    sample.material.clear();
    return alike ? ""
                 : "its bodies are of several materials, and the scene names none: write its [[material]]s";
  }
  if (sample.material.empty()) return "";
  const std::string& given = scene.samples.front().material;
  if (!given.empty())
    return fmt::format("it says of which material each body is: leave `material = \"{}\"` out", given);
  for (Material& material : sample.material) {
    const std::string name = material < names.size() ? names[material] : fmt::format("number {}", material);
    const auto found = std::ranges::find(scene.materials, name, &io::MaterialSpec::name);
    if (found == scene.materials.end())
      return fmt::format("it has bodies of material '{}', and the scene has no [[material]] of that name",
                         name);
    material = static_cast<Material>(found - scene.materials.begin());
  }
  return "";
}

/// The flow of the next stage would come on top of that of the last one.
void leave_flow(const Domain& domain, Sample& sample) {
  if (!domain.repeats) return;
  const Mat3 gradient = gradient_before(domain, 0);
  for (std::size_t k = 0; k < sample.size(); ++k)
    Eigen::Map<Vec3>(sample.velocity[k].data()) -= gradient * (sample.x[k] - domain.low);
}

}  // namespace

StateSample read_state(const io::Scene& scene) {
  const auto refuse = [&](const std::string& what) { throw io::error_in(scene, "sample.file", what); };
  const std::string name = std::filesystem::path(scene.samples.front().file).filename().string();
  const bool checkpoint = io::is_checkpoint_name(name);
  if (checkpoint && scene.samples.front().frame) refuse("a checkpoint has no frames: leave `frame` out");
  StateSample state;
  try {
    state = checkpoint ? state_of_checkpoint(scene) : state_of_frame(scene);
  } catch (const io::FileError& error) {
    refuse(error.what());
  }
  if (!scene.setup.clumps.empty() || state.clumps)
    refuse("states of clumps cannot be begun from: begin with the sample that the run began with");
  if (!same_cell(state.domain, scene.setup.domain))
    refuse(fmt::format("it is of a run with {}, and the scene has {}: write the former",
                       words_of(state.domain), words_of(scene.setup.domain)));
  leave_flow(state.domain, state.sample);
  Sample& sample = state.sample;
  sample.density = scene.density;
  sample.rotates = scene.setup.rotation;
  if (const std::string unknown = name_materials(scene, state.materials, sample); !unknown.empty())
    refuse(unknown);
  return state;
}

CellVelocity stress_at_start(const Sample& sample, std::span<const GivenForce> forces, const Setup& setup) {
  CellVelocity stress{};
  if (!setup.domain.repeats) return stress;
  std::map<std::int64_t, const Vec3*> centre;
  for (std::size_t k = 0; k < sample.size(); ++k)
    centre[static_cast<std::int64_t>(sample.id_of(k))] = &sample.x[k];
  for (const GivenForce& force : forces) {
    const auto first = centre.find(force.first), second = centre.find(force.second);
    if (first == centre.end() || second == centre.end()) continue;
    add_impulse(Vec3(force.force), setup.domain.separation(*first->second, *second->second), stress);
  }
  const double volume = setup.domain.volume(setup.walls);
  for (double& component : stress) component = volume > 0 ? component / volume : 0;
  return stress;
}

void place_walls_of(const std::vector<WallReport>& walls, io::Scene& scene) {
  for (Wall& wall : scene.setup.walls) {
    const auto found = std::ranges::find(walls, wall.name, &WallReport::name);
    Eigen::Index axis = 0;
    if (found == walls.end() || wall.surface() != nullptr ||
        std::abs(wall.normal.cwiseAbs().maxCoeff(&axis)) != 1 || !std::isnan(wall.point[axis]))
      continue;
    wall.point[axis] = wall.normal[axis] * found->position;
    if (wall.load.pushed() && wall.velocity.isZero(0)) wall.velocity = found->velocity * wall.normal;
  }
}

std::vector<std::string> warnings_of_surfaces(const std::vector<WallReport>& walls, const io::Scene& scene) {
  std::vector<std::string> warnings;
  for (const Wall& wall : scene.setup.walls) {
    const auto found = std::ranges::find(walls, wall.name, &WallReport::name);
    if (wall.surface() == nullptr || found == walls.end() || !found->pose.moved) continue;
    warnings.push_back(
        fmt::format("wall '{}' had moved in the run that the state is of, and begins where this scene puts "
                    "it: grains that "
                    "stood on it may overlap it, or stand free. Put it where it was, or `--resume` that run",
                    wall.name));
  }
  return warnings;
}

}  // namespace talus
