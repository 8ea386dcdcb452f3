#include "apps/shared/scene_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <span>

#include "apps/shared/sample_builder.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/samples/detail/random_numbers.hpp"
#include "kernels/shapes/region.hpp"

namespace talus {

namespace {

/// Densities of what grains are made of [kg/m^3]: foam of polystyrene has 15 to 30, osmium 22,600.
constexpr double lightest = 30, heaviest = 23000;

void add_density(const std::string& where, double density, std::vector<std::string>& warnings) {
  if (density < lightest)
    warnings.push_back(
        fmt::format("{}density = {:g} kg/m^3 is less than that of foam{}", where, density,
                    1000 * density < lightest || 1000 * density > heaviest
                        ? ""
                        : fmt::format("; {:g} g/cm^3 are {:g} kg/m^3", density, 1000 * density)));
  if (density > heaviest)
    warnings.push_back(
        fmt::format("{}density = {:g} kg/m^3 is more than that of any element", where, density));
}

/// Coefficients of friction: silicone rubber on glass comes to 2 or 3.
constexpr double roughest = 5;

void add_friction(const io::Scene& scene, std::vector<std::string>& warnings) {
  double mu = 0;
  for (const Stage& stage : scene.setup.stages)
    for (Material a = 0; stage.laws.knows(a); ++a)
      for (Material b = 0; b <= a; ++b) mu = std::max(mu, stage.laws.between(a, b).friction);
  if (mu > roughest)
    warnings.push_back(fmt::format("a coefficient of friction is {:g}, more than surfaces have{}", mu,
                                   mu <= 100 ? fmt::format("; {:g} % are {:g}", mu, mu / 100) : ""));
}

/// The largest boulders of a rock fall, and the largest grains that may be meant in mm [m].
constexpr double largest_stone = 5, largest_in_mm = 1000;

/// Positions whose last bit is more than this part of a radius leave gaps to chance.
constexpr double coarse = 1e-6;

void add_lengths(const Sample& sample, std::vector<std::string>& warnings) {
  if (sample.size() == 0) return;
  const double smallest = *std::ranges::min_element(sample.radius);
  if (smallest > largest_stone)
    warnings.push_back(fmt::format(
        "sample: the smallest grain has a radius of {:g} m{}", smallest,
        smallest > largest_in_mm ? "" : fmt::format("; {:g} mm are {:g} m", smallest, smallest / 1000)));
  double farthest = 0;
  for (const Vec3& x : sample.x) farthest = std::max(farthest, x.cwiseAbs().maxCoeff());
  const double bit = farthest * std::numeric_limits<double>::epsilon();
  if (bit > coarse * smallest)
    warnings.push_back(fmt::format(
        "sample: grains lie {:.3g} m from the origin, where positions are known to {:.2g} m, {:.2g} of the "
        "smallest radius: move the sample nearer",
        farthest, bit, bit / smallest));
}

/// More steps than any machine makes.
constexpr double endless = 1e10;

void add_endless_stages(const io::Scene& scene, std::vector<std::string>& warnings) {
  for (const Stage& stage : scene.setup.stages)
    if (stage.end.time && stage.time_step > 0 && *stage.end.time > endless * stage.time_step)
      warnings.push_back(fmt::format("stage '{}': end.time = {:g} s takes {:.2g} steps; times are in seconds",
                                     stage.name, *stage.end.time, *stage.end.time / stage.time_step));
}

/// Length of the stage named, or of the whole run, at most [s]; infinity where that is open.
double latest_end(const io::Scene& scene, const std::string& only) {
  double sum = 0;
  for (const Stage& stage : scene.setup.stages) {
    if (!only.empty() && stage.name != only) continue;
    double time = stage.end.time.value_or(INFINITY);
    if (stage.end.time && !stage.chooses_time_step) time = steps_in(time, stage.time_step) * stage.time_step;
    if (stage.end.steps) time = std::min(time, static_cast<double>(*stage.end.steps) * stage.longest_step());
    sum += time;
  }
  return sum;
}

/// What is to happen when the run has ended. What is due at its very end would come in the step after it.
void add_late(const io::Scene& scene, std::vector<std::string>& warnings) {
  constexpr double rounding = 1e-9;
  for (const RemoveRule& rule : scene.setup.removes) {
    const double end = latest_end(scene, rule.times.stage);
    const double last = rule.at.empty() ? rule.times.from : rule.at.back();
    if (last > 0 && last >= end * (1 - rounding))
      warnings.push_back(fmt::format("remove '{}': {} = {:g} s is never reached: {} ends by {:g} s",
                                     rule.name, rule.at.empty() ? "from" : "at", last,
                                     rule.times.stage.empty() ? "the run" : "its stage", end));
  }
  const double end = latest_end(scene, "");
  for (const ProbeRule& rule : scene.setup.probes)
    if (rule.every && !rule.every_steps && *rule.every > end * (1 + rounding))
      warnings.push_back(fmt::format("probe '{}': every = {:g} s is never reached: the run ends by {:g} s",
                                     rule.name, *rule.every, end));
}

/// A belt moves along its surface only: of a motion along the normal nothing but rounding is left.
void add_still_belts(const io::Scene& scene, std::vector<std::string>& warnings) {
  constexpr double rounding = 1e-9;
  for (const Wall& wall : scene.setup.walls) {
    if (wall.motion.size() != 1 || !wall.motion[0].surface_only || wall.surface() != nullptr) continue;
    const MotionPart& motion = wall.motion[0];
    const Vec3& way = motion.kind == MotionPart::Kind::oscillation ? motion.direction : motion.velocity;
    if (way.norm() > 0 && (way - way.dot(wall.normal) * wall.normal).norm() < rounding * way.norm())
      warnings.push_back(
          fmt::format("the surface of wall '{}' is to move along its normal: it stands still", wall.name));
  }
}

/// Surfaces may stand anywhere.
bool stands_against(const Wall& wall, const Vec3& gravity) {
  return wall.surface() != nullptr || wall.normal.dot(gravity) < 0;
}

void add_gravity(const io::Scene& scene, std::vector<std::string>& warnings) {
  for (const Stage& stage : scene.setup.stages) {
    const Vec3& g = stage.gravity;
    const std::string where =
        fmt::format("gravity of stage '{}' is ({:g}, {:g}, {:g}) m/s^2", stage.name, g[0], g[1], g[2]);
    if (g[2] > 0)
      warnings.push_back(where + ", upwards: z points up");
    else if (g.norm() > 0 &&
             (scene.setup.walls.empty() ? scene.setup.domain.repeats : !stage.laws.attract()) &&
             std::ranges::none_of(scene.setup.walls,
                                  [&](const Wall& wall) { return stands_against(wall, g); }))
      warnings.push_back(where + ", and no wall stands against it: the grains fall for ever");
  }
}

/// Nothing can come where walls are.
void add_regions(const io::Scene& scene, std::vector<std::string>& warnings) {
  constexpr std::uint64_t probes = 256;
  for (const InsertRule& rule : scene.setup.inserts) {
    const double radius = smallest_radius(rule.radii);
    bool free = false;
    for (std::uint64_t k = 0; k < probes && !free; ++k) {
      const auto [a, b] = detail::uniform_pair(1, k, 0);
      const Place place = place_in(rule.region, radius, {a, b, detail::uniform_pair(1, k, 1)[0]});
      free = place.found && std::ranges::none_of(scene.setup.walls, [&](const Wall& wall) {
               return meets_wall(wall, place.x, radius);
             });
    }
    if (!free)
      warnings.push_back(fmt::format(
          "the region of insert '{}' lies in or behind walls: no grain will find room there", rule.name));
  }
}

/// A deposition fills pores with small grains, far below the place where they would have come to rest.
void add_segregation(const io::Scene& scene, const Sample& sample, std::vector<std::string>& warnings) {
  constexpr double sorted = 1.5;  // mean radii, highest over lowest fifth; radii of 1 : 5 give 2.0
  if (scene.samples.size() != 1 || scene.samples.front().kind != io::SampleSpec::Kind::deposition) return;
  const std::size_t fifth = sample.size() / 5;
  if (fifth < 20) return;
  std::vector<std::size_t> by_height(sample.size());
  std::iota(by_height.begin(), by_height.end(), std::size_t{0});
  std::ranges::sort(by_height, {}, [&](std::size_t k) { return sample.x[k][2]; });
  double low = 0, high = 0;
  for (std::size_t k = 0; k < fifth; ++k) {
    low += sample.radius[by_height[k]] / static_cast<double>(fifth);
    high += sample.radius[by_height[sample.size() - 1 - k]] / static_cast<double>(fifth);
  }
  if (high > sorted * low)
    warnings.push_back(
        fmt::format("the deposition is sorted by size: the mean radius of the lowest fifth of the grains is "
                    "{:.3g} m, of the highest {:.3g} m. Let such sizes rain instead, with an [[insert]]",
                    low, high));
}

/// Nothing rolls without friction. Pairs of materials that never meet are left out.
void add_idle_rolling(const io::Scene& scene, const Sample& sample, std::vector<std::string>& warnings) {
  std::set<Material> of_grains(sample.material.begin(), sample.material.end()), of_all;
  if (sample.material.empty() && sample.size() > 0) of_grains.insert(material_of_grains);
  for (const InsertRule& rule : scene.setup.inserts) of_grains.insert(rule.material);
  of_all = of_grains;
  for (const Wall& wall : scene.setup.walls) of_all.insert(wall.material);
  const std::vector<std::string>& names = scene.setup.material_names;
  const auto name = [&](Material m) -> std::string {
    if (!names.empty()) return "'" + names.at(m) + "'";
    return m == material_of_grains ? "grains" : "walls";
  };
  const auto idle = [](const PairLaw& law) { return law.rolling_resistance > 0 && law.friction == 0; };
  for (const Material a : of_grains)
    for (const Material b : of_all) {
      if (b < a && of_grains.contains(b)) continue;
      const auto stage = std::ranges::find_if(scene.setup.stages,
                                              [&](const Stage& of) { return idle(of.laws.between(a, b)); });
      if (stage != scene.setup.stages.end())
        warnings.push_back(fmt::format(
            "rolling_resistance of {} and {} does nothing in stage '{}': they have no friction, and "
            "nothing rolls without it",
            name(a), name(b), stage->name));
    }
}

/// Row of a table of displacements at which grains that rebound feel two weaker impacts in place of one: its
/// velocity jumps there, and not in the middle of a step, from where on walls move until the next middle. The
/// second impact finds them on their way already, however short the steps are. 0: there is none. Along
/// `normal`, or in any direction where that is 0.
std::size_t split_jump(const MotionTable& table, const Vec3& normal, double h) {
  // Of the fastest velocity along the normal, and of the fastest one, less than which is noise; of a step;
  // steps.
  constexpr double part = 0.5, noise = 1e-3, near = 0.01, apart = 4;
  if (!table.velocity.empty() || table.shift.empty()) return 0;
  const auto whole = [&](std::size_t k) {
    return Vec3((table.shift[k + 1] - table.shift[k]) / (table.t[k + 1] - table.t[k]));
  };
  const auto velocity = [&](std::size_t k) {
    return normal.isZero(0) ? whole(k) : Vec3(normal.dot(whole(k)) * normal);
  };
  double least = 0;
  for (std::size_t k = 0; k + 1 < table.t.size(); ++k)
    least = std::max({least, part * velocity(k).norm(), noise * whole(k).norm()});
  for (std::size_t k = 1; k + 1 < table.t.size(); ++k) {
    if (std::min(table.t[k] - table.t[k - 1], table.t[k + 1] - table.t[k]) < apart * h) continue;
    const double phase = table.t[k] / h - 0.5;
    if ((velocity(k) - velocity(k - 1)).norm() > least && std::abs(phase - std::round(phase)) > near)
      return k;
  }
  return 0;
}

/// The time step of all stages in which the motion may be, where grains rebound from the wall in each; else
/// 0.
double one_step_of_rebounds(std::span<const Stage> stages, const Wall& wall, const MotionPart& motion) {
  const auto named = [&](const std::string& name) { return std::ranges::find(stages, name, &Stage::name); };
  const auto begin = motion.from_stage.empty() ? stages.begin() : named(motion.from_stage);
  const auto end = motion.until_stage.empty() ? stages.end() : named(motion.until_stage);
  double h = 0;
  for (auto stage = begin; stage < end; ++stage) {
    double restitution = 0;
    for (Material m = 0; stage->laws.knows(m); ++m)
      restitution = std::max(restitution, stage->laws.between(m, wall.material).restitution);
    if (restitution == 0 || stage->time_step == 0 || (h > 0 && stage->time_step != h)) return 0;
    h = stage->time_step;
  }
  return h;
}

void add_jumps(const io::Scene& scene, std::vector<std::string>& warnings) {
  std::set<std::string> told;  // files
  for (const Wall& wall : scene.setup.walls)
    for (const MotionPart& motion : wall.motion) {
      if (!motion.table || motion.surface_only || told.contains(motion.file)) continue;
      const double h = one_step_of_rebounds(scene.setup.stages, wall, motion);
      if (h == 0) continue;
      const Vec3 normal = wall.surface() == nullptr ? wall.normal : Vec3(Vec3::Zero());
      const std::size_t row = split_jump(*motion.table, normal, h);
      if (row == 0) continue;
      told.insert(motion.file);
      const double t = motion.table->t[row];
      warnings.push_back(
          fmt::format("the velocity of wall '{}' jumps at {:.10g} s of {}, which is not the middle of a "
                      "step: grains rebound "
                      "from it as from two weaker impacts, however short the steps are. Give the row the "
                      "time {:.10g} s, or "
                      "let a motion of one velocity begin there with a stage",
                      wall.name, t, motion.file, (std::floor(t / h * (1 + 1e-12)) + 0.5) * h));
    }
}

/// What a flow has pressed together is let go where a ramp begins at 0.
void add_ramps_from_nothing(const io::Scene& scene, std::vector<std::string>& warnings) {
  const std::vector<Stage>& stages = scene.setup.stages;
  for (std::size_t s = 1; s < stages.size(); ++s) {
    std::string axes;
    for (std::size_t k = 0; k < 3; ++k)
      if (stages[s].stress.to[k].value_or(0) != 0 && stages[s].stress.ramp_time > 0 &&
          !stages[s - 1].stress.to[k] && stages[s - 1].flows())
        axes += std::string(axes.empty() ? "" : ", ") + "xyz"[k];
    if (!axes.empty())
      warnings.push_back(
          fmt::format("the stress of stage '{}' rises from 0 Pa along {}, as stage '{}' follows none there: "
                      "grains that are pressed together by then are let go first. Put a stage of one step "
                      "between them, with the stress that the ramp shall begin from and no ramp_time",
                      stages[s].name, axes, stages[s - 1].name));
  }
}

}  // namespace

std::vector<std::string> scene_warnings(const io::Scene& scene, const Sample& sample) {
  std::vector<std::string> warnings;
  if (scene.setup.walls.empty() && scene.setup.domain.edges().minCoeff() == 0)
    warnings.push_back("the scene has no walls: nothing holds the grains");
  add_gravity(scene, warnings);
  add_regions(scene, warnings);
  add_segregation(scene, sample, warnings);
  add_idle_rolling(scene, sample, warnings);
  add_jumps(scene, warnings);
  add_ramps_from_nothing(scene, warnings);
  add_friction(scene, warnings);
  add_lengths(sample, warnings);
  add_endless_stages(scene, warnings);
  add_late(scene, warnings);
  add_still_belts(scene, warnings);
  if (const auto parts = static_cast<std::size_t>(scene.setup.decomposition.subdomains);
      parts > std::max<std::size_t>(1, sample.size()) && scene.setup.inserts.empty())
    warnings.push_back(fmt::format("{} subdomains for {} grains: most of them hold none; fewer are faster",
                                   parts, sample.size()));
  if (scene.materials.empty()) add_density("material.", scene.density, warnings);
  for (const io::MaterialSpec& material : scene.materials)
    add_density(fmt::format("material '{}': ", material.name), material.density, warnings);
  if (std::string overlaps = describe_overlaps(scene, sample); !overlaps.empty())
    warnings.push_back(std::move(overlaps));
  for (std::string& warning : warnings)
    if (const int line = io::line_of(scene.places, "", warning); line > 0)
      warning = fmt::format("{}:{}: {}", scene.source_file, line, warning);
  return warnings;
}

}  // namespace talus
