#include "apps/shared/sample_builder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

#include "apps/shared/patience.hpp"
#include "apps/shared/sample_join.hpp"
#include "apps/shared/signals.hpp"
#include "apps/shared/state_sample.hpp"
#include "io/scene/bodies_file.hpp"
#include "kernels/bodies/farthest.hpp"
#include "kernels/detection/images.hpp"
#include "kernels/detection/wall_pairs.hpp"
#include "kernels/samples/sample.hpp"
#include "kernels/samples/scatter.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus {

namespace {

/// What fits a Slot.
constexpr std::int64_t most_grains = 2147483647;

std::vector<Vec3> lattice_sites(const io::SampleSpec& sample, const std::vector<double>& radii,
                                std::uint64_t seed) {
  const double diameter = 2 * *std::max_element(radii.begin(), radii.end());
  const double spacing = sample.spacing * diameter;
  Lattice sites;
  sites.spacing = spacing;
  sites.jitter = 0.5 * sample.noise * (spacing - diameter);
  sites.seed = seed;
  sites.length_x = sample.cells[0] > 0 ? static_cast<double>(sample.cells[0]) * spacing : sample.base[0];
  sites.length_y = sample.cells[1] > 0 ? static_cast<double>(sample.cells[1]) * spacing : sample.base[1];
  return lattice(radii, sites);
}

double bytes_there() {
  return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

/// Throws SceneError when this process cannot hold the grains that it is to make.
void demand_memory(const io::Scene& scene, double grains) {
  // What a grain takes while it is deposited, and all in all with its contacts (docs/performance.md).
  constexpr double bytes_made = 100, bytes_run = 1260;
  const double there = bytes_there();
  if (grains * bytes_made > there)
    throw io::error_in(scene, "sample",
                       fmt::format("{:.3g} grains take about {:.3g} GB to make and {:.3g} GB to run; this "
                                   "machine has {:.3g} GB. Ask for fewer",
                                   grains, grains * bytes_made / 1e9, grains * bytes_run / 1e9, there / 1e9));
}

std::vector<Vec3> places_of(const io::SampleSpec& spec, const std::vector<double>& radii,
                            std::uint64_t seed) {
  std::vector<Vec3> places;
  if (spec.kind == io::SampleSpec::Kind::lattice) {
    places = lattice_sites(spec, radii, seed);
  } else {
    Patience patience;
    places = deposit(radii, spec.base[0], spec.base[1], [&](std::size_t placed) {
      if (stop_signal() != 0)
        throw std::runtime_error(fmt::format("{} came as grain {} of {} was deposited",
                                             signal_name(stop_signal()), placed, radii.size()));
      patience.tell([&] { return fmt::format("{} of {} grains deposited", placed, radii.size()); });
    });
  }
  if (!spec.origin.isZero(0))
    for (Vec3& x : places) x += spec.origin;
  return places;
}

/// The sites of a lattice in its region: `count` of them, or all.
std::vector<Vec3> sites_in_region(const io::Scene& scene, const io::SampleSpec& spec,
                                  const std::string& path) {
  const double largest = largest_radius(spec.radii), spacing = spec.spacing * 2 * largest;
  const Bounds bounds = bounds_of(*spec.region);
  const Vec3 cells = ((bounds.high - bounds.low) / spacing).array().max(1);
  demand_memory(scene, spec.count > 0 ? static_cast<double>(spec.count) : cells.prod());
  const auto most =
      spec.count > 0 ? static_cast<std::size_t>(spec.count) : static_cast<std::size_t>(most_grains);
  std::vector<Vec3> sites = lattice_in(*spec.region, largest, spacing, most);
  if (spec.count > 0 && sites.size() < most)
    throw io::error_in(scene, path,
                       fmt::format("the region has {} sites for {} grains; make it larger, or leave count "
                                   "out",
                                   sites.size(), spec.count));
  return sites;
}

/// Sample k, among the grains of those `before`.
std::vector<Vec3> random_places(const io::Scene& scene, std::size_t k, const std::vector<double>& radii,
                                std::span<const Sample> before) {
  const io::SampleSpec& spec = scene.samples[k];
  const Domain& domain = scene.setup.domain;
  const Bounds box = spec.region ? bounds_of(*spec.region) : Bounds{domain.low, domain.low + domain.edges()};
  StandingGrains stand;
  for (const Sample& other : before) {
    stand.x.insert(stand.x.end(), other.x.begin(), other.x.end());
    stand.radius.insert(stand.radius.end(), other.radius.begin(), other.radius.end());
  }
  try {
    return scatter(radii, {box.low, box.high, domain, scene.setup.seed, static_cast<std::uint32_t>(k)},
                   stand);
  } catch (const std::invalid_argument& error) {
    throw io::error_in(scene, io::key_of_sample(scene, k) + ".count", error.what());
  }
}

void set_velocity(const io::SampleSpec& spec, Sample& sample) {
  if (spec.velocity.isZero(0) && spec.angular_velocity.isZero(0)) return;
  const Vec3& u = spec.velocity;
  for (const double radius : sample.radius) {
    const Vec3 w = radius * spec.angular_velocity;
    sample.velocity.push_back({u[0], u[1], u[2], w[0], w[1], w[2]});
  }
}

/// Sample `k` of the scene, behind those `before`.
Sample make_part(const io::Scene& scene, std::size_t k, std::span<const Sample> before) {
  using Kind = io::SampleSpec::Kind;
  const io::SampleSpec& spec = scene.samples[k];
  const bool given = spec.kind == Kind::bodies;
  Sample sample =
      given ? io::read_bodies(spec.file, scene.density, scene.setup.rotation, scene.materials) : Sample{};
  sample.density = scene.density;
  sample.rotates = scene.setup.rotation;
  if (!scene.setup.clumps.empty()) sample.shape = mass_of(1, scene.setup.clumps.front());
  sample.seed = scene.setup.seed;
  if (given) return sample;
  const auto stream = static_cast<std::uint32_t>(k);
  const auto draw = [&](std::size_t n) { return draw_radii(spec.radii, n, scene.setup.seed, stream); };
  if (spec.kind == Kind::body) {
    sample.x = {spec.position};
    sample.radius = draw(1);
    sample.named = {BodyId{0}};
  } else if (spec.kind == Kind::random) {
    demand_memory(scene, static_cast<double>(spec.count));
    sample.radius = draw(static_cast<std::size_t>(spec.count));
    sample.x = random_places(scene, k, sample.radius, before);
  } else if (spec.region) {
    sample.x = sites_in_region(scene, spec, io::key_of_sample(scene, k) + ".region");
    sample.radius = draw(sample.x.size());
  } else {
    demand_memory(scene, static_cast<double>(spec.grains()));
    sample.radius = draw(static_cast<std::size_t>(spec.grains()));
    sample.x = places_of(spec, sample.radius, scene.setup.seed);
  }
  set_velocity(spec, sample);
  return sample;
}

/// What Simulation would refuse (validate of Bodies), while the file that says it is at hand.
void check(const io::Scene& scene, const Sample& sample) {
  const bool one_file = scene.samples.size() == 1 && scene.samples.front().from_file();
  const std::string& file = one_file ? scene.samples.front().file : scene.source_file;
  for (std::size_t k = 0; k < sample.size(); ++k) {
    const auto refuse = [&](const std::string& what) {
      throw io::SceneError(file, 0, "",
                           fmt::format("body {}: {}", static_cast<std::int64_t>(sample.id_of(k)), what));
    };
    if (const double m = mass(sample, k); !mass_is_sound(m))
      refuse(fmt::format(
          "a radius of {} m with a density of {} kg/m^3 makes a mass of {} kg, which must lie in {} to {}; "
          "give lengths in m and densities in kg/m^3",
          sample.radius[k], sample.density_of(k), m, least_mass, most_mass));
    if (!within_farthest(sample.x[k].cwiseAbs().maxCoeff())) refuse("its centre must be within 1e15 m");
    if (!sample.velocity.empty() && !std::ranges::all_of(sample.velocity[k], within_farthest))
      refuse("its velocity, and radius times angular velocity, must be within 1e15 m/s");
    if (!sample.velocity.empty() && sample.shape.number != 0 &&
        std::any_of(sample.velocity[k].begin() + 3, sample.velocity[k].end(),
                    [](double w) { return w != 0; }))
      refuse("clumps begin without rotation; leave wx, wy, wz out");
  }
}

/// By how much a sphere overlaps a wall [m]; 0 or less where it does not.
double depth_at(const Wall& wall, const Vec3& x, double radius) {
  if (wall.surface() == nullptr) return radius - wall_point(wall, x, 0, {}).distance;
  std::vector<SurfacePoint> points;
  wall.surface()->collide(x, radius, points);
  double depth = 0;
  for (const SurfacePoint& point : points) depth = std::max(depth, radius - point.distance);
  return depth;
}

struct Overlaps {
  std::size_t count = 0;
  double worst = 0.1;  ///< depth over the smaller radius; less is none
  std::string between;

  void add(double depth, const auto& describe) {
    if (depth <= 0.1) return;
    ++count;
    if (depth <= worst) return;
    worst = depth;
    between = describe();
  }
};

/// visit(place from the centre [m], radius [m]) for each ball of grain k; a sphere is one.
void each_ball(const io::Scene& scene, const Sample& sample, std::size_t k, const auto& visit) {
  const double radius = sample.radius[k];
  if (sample.shape.number == 0) return visit(Vec3(Vec3::Zero()), radius);
  const Mat3 turned = rotation_of(draw_orientation(sample.seed, static_cast<std::uint64_t>(sample.id_of(k))));
  for (const Ball& ball : scene.setup.clumps[sample.shape.number - std::size_t{1}].balls)
    visit(Vec3(radius * (turned * ball.centre)), radius * ball.radius);
}

/// The deepest, over the smaller radius, of balls of grains a and b.
double overlap_of(const io::Scene& scene, const Sample& sample, std::size_t a, std::size_t b) {
  const Vec3 apart = scene.setup.domain.separation(sample.x[a], sample.x[b]);
  double deepest = 0;
  each_ball(scene, sample, a, [&](const Vec3& x, double r) {
    each_ball(scene, sample, b, [&](const Vec3& y, double s) {
      deepest = std::max(deepest, (r + s - (apart + x - y).norm()) / std::min(r, s));
    });
  });
  return deepest;
}

}  // namespace

void demand_memory_of_graph(const io::Scene& scene, int ranks) {
  // Tasks of a subdomain wait for those of all. On one rank 8000 subdomains took 1.56 GB, 4000 took 0.42.
  constexpr double bytes_of_pair = 25;
  const double subdomains = scene.setup.decomposition.subdomains, there = bytes_there();
  const double needed = bytes_of_pair * subdomains * subdomains / ranks;
  if (needed > there)
    throw io::error_in(
        scene, "decomposition.subdomains",
        fmt::format(
            "the graph of a step of {} subdomains takes about {:.3g} GB a rank; this machine has {:.3g} "
            "GB. Ask for fewer, which hold some hundred grains each or more",
            subdomains, needed / 1e9, there / 1e9));
}

void put_materials(const io::Scene& scene, Sample& sample, std::size_t of_sample) {
  if (scene.materials.empty()) return;
  sample.material_density.clear();
  for (const io::MaterialSpec& material : scene.materials)
    sample.material_density.push_back(material.density);
  if (!sample.material.empty()) return;
  const std::string name = of_sample < scene.samples.size() ? scene.samples[of_sample].material : "";
  const auto named = std::ranges::find(scene.materials, name, &io::MaterialSpec::name);
  const auto of_all = named == scene.materials.end() ? 0 : named - scene.materials.begin();
  sample.material.assign(sample.size(), static_cast<Material>(of_all));
}

Sample build_sample(const io::Scene& scene, std::optional<Sample> state) {
  std::vector<Sample> parts;
  for (std::size_t k = 0; k < scene.samples.size(); ++k) {
    const bool is_state = scene.samples[k].kind == io::SampleSpec::Kind::state;
    parts.push_back(!is_state ? make_part(scene, k, parts)
                    : state   ? std::move(*state)
                              : read_state(scene).sample);
    put_materials(scene, parts.back(), k);
  }
  Sample sample = parts.size() == 1 ? std::move(parts.front()) : join_samples(scene, std::move(parts));
  check(scene, sample);
  for (Vec3& x : sample.x) x = scene.setup.domain.wrap(x);
  return sample;
}

std::string describe_overlaps(const io::Scene& scene, const Sample& sample) {
  Overlaps overlaps;
  const auto id = [&](std::size_t k) { return static_cast<std::int64_t>(sample.id_of(k)); };
  // Samples that are made have none between grains, but for lattices and depositions that are larger than a
  // cell: only what is put at random knows of its faces.
  const auto may_overlap = [&](const io::SampleSpec& spec) {
    return spec.from_file() || (scene.setup.domain.repeats && spec.kind != io::SampleSpec::Kind::random);
  };
  if (std::ranges::any_of(scene.samples, may_overlap)) {
    for (const GrainPair& pair : near_pairs(scene.setup.domain, sample.x, sample.radius)) {
      const auto a = static_cast<std::size_t>(pair.first), b = static_cast<std::size_t>(pair.second);
      overlaps.add(overlap_of(scene, sample, a, b),
                   [&] { return fmt::format("grains {} and {}", id(a), id(b)); });
    }
  }
  for (const Wall& wall : scene.setup.walls)
    for (std::size_t k = 0; stands_at_first(scene.setup, wall) && k < sample.size(); ++k) {
      if (depth_at(wall, sample.x[k], sample.radius[k]) <= 0) continue;
      double deepest = 0;
      each_ball(scene, sample, k, [&](const Vec3& x, double r) {
        deepest = std::max(deepest, depth_at(wall, sample.x[k] + x, r) / r);
      });
      overlaps.add(deepest, [&] { return fmt::format("grain {} and wall '{}'", id(k), wall.name); });
    }
  if (overlaps.count == 0) return "";
  return fmt::format(
      "{} overlap{} of more than 10 % of the smaller radius, the deepest of {:.0f} % between {}; {}",
      overlaps.count, overlaps.count == 1 ? "" : "s", 100 * overlaps.worst, overlaps.between,
      scene.setup.solver.overlap_correction > 0
          ? "solver.overlap_correction parts them"
          : "they stay as they are: set solver.overlap_correction to 0.1, or begin from another sample");
}

}  // namespace talus
