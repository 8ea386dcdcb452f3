#include "io/scene/detail/sample_read.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "io/scene/detail/material_read.hpp"
#include "io/scene/detail/scene_read.hpp"
#include "kernels/shapes/clump.hpp"

namespace talus::io::detail {

namespace {

using SampleKind = SampleSpec::Kind;

void check_lattice(const toml::table& table, const std::string& path, const SampleSpec& sample) {
  const bool on_base = sample.count > 0 && sample.base[0] > 0;
  const bool by_cells = sample.cells[0] > 0;
  if (sample.region && (by_cells || sample.base[0] > 0))
    fail_at(table, path, "a lattice that fills its region has neither base nor cells");
  if (!sample.region && (by_cells ? sample.count > 0 || sample.base[0] > 0 : !on_base))
    fail_at(table, path, "a lattice needs either cells, or count and base");
  if (const double grains = static_cast<double>(sample.cells[0]) * static_cast<double>(sample.cells[1]) *
                            static_cast<double>(sample.cells[2]);
      grains > countable.high)
    fail_at(*table.get("cells"), path + ".cells",
            fmt::format("makes {:.3g} grains, more than {:.0f}", grains, countable.high));
}

void check_random(const toml::table& table, const std::string& path, const SampleSpec& sample,
                  const Domain& domain) {
  if (sample.count == 0) fail_at(table, path + ".count", "missing; random grains are counted");
  for (const Eigen::Index axis : {0, 1, 2}) {
    const double edge = domain.edges()[axis];
    if (!sample.region && edge == 0)
      fail_at(table, path + ".region",
              fmt::format("missing; random grains need a box, since nothing repeats along {}", "xyz"[axis]));
    if (const double largest = 2 * largest_radius(sample.radii); edge > 0 && edge < 2 * largest)
      fail_at(table, path,
              fmt::format("has grains of {} m, and along {} the cell is {} m long: two of them have to fit",
                          largest, "xyz"[axis], edge));
    if (!sample.region || edge == 0) continue;
    const double low = sample.region->low[axis], high = sample.region->high[axis];
    constexpr double rounding = 1e-12;  // of corners that are written in decimals
    if (high - low > edge + rounding * std::max({std::abs(low), std::abs(high), edge}))
      fail_at(*table.get("region"), path + ".region",
              fmt::format("is longer along {} than the cell, {} m", "xyz"[axis], edge));
  }
}

void check_room(const toml::table& table, const std::string& path, const SampleSpec& sample) {
  const double largest = largest_radius(sample.radii);
  if (sample.count > 0)
    for (const double side : sample.base)
      if (sample.base[0] > 0 && side < 2 * largest)
        fail_at(*table.get("base"), path + ".base",
                fmt::format("a side of {} m is less than the largest diameter, {} m", side, 2 * largest));
  if (sample.region && !has_room(*sample.region, largest))
    fail_at(*table.get("region"), path + ".region",
            fmt::format("has no room for the largest grain, {} m wide", 2 * largest));
}

void check_file(const toml::table& table, const std::string& path, const std::filesystem::path& folder,
                SampleSpec& sample) {
  const std::filesystem::path file = (folder / sample.file).lexically_normal();
  if (!std::filesystem::is_regular_file(file))
    fail_at(*table.get("file"), path + ".file", fault_of_file(file));
  sample.file = file.string();
}

/// What a sample must agree on with those before it.
void check_among(const toml::table& table, const std::string& path, const SampleSpec& sample,
                 const Scene& scene) {
  if (sample.kind == SampleKind::state && !scene.samples.empty())
    fail_at(table, path + ".kind", "a state must be the first sample: its grains keep their ids");
  for (const SampleSpec& other : scene.samples) {
    if (!sample.name.empty() && sample.name == other.name)
      fail_at(*table.get("name"), path + ".name",
              fmt::format("another sample is named '{}' already", sample.name));
    if (sample.shape != other.shape)
      fail_at(table, path + ".shape",
              fmt::format("all samples of a scene have grains of one shape; an earlier one has '{}'",
                          body_shapes().of(other.shape).name));
  }
}

void read_sample(const toml::table& table, const std::string& path, const std::filesystem::path& folder,
                 Scene& scene) {
  SampleSpec sample;
  read_table(table, path, scene_keys().sample, {"region"}, sample);
  read_material(table, path, scene, material_of_grains);
  if (!sample.name.empty() || table.get("name")) check_name(table, path, sample.name);
  check_among(table, path, sample, scene);
  const bool random = sample.kind == SampleKind::random;
  if (const toml::node* region = table.get("region"); region && sample.kind != SampleKind::lattice && !random)
    fail_at(*region, path + ".region", "has a meaning only with: kind = lattice or random");
  sample.region = random ? read_region(table, path, {Region::Kind::box})
                         : read_region(table, path, {Region::Kind::box, Region::Kind::cylinder});
  if (random) check_random(table, path, sample, scene.setup.domain);
  if (sample.noise > 0 && sample.region)
    fail_at(*table.get("noise"), path + ".noise", "a lattice that fills a region has none");
  if (sample.kind == SampleKind::deposition && !(sample.count > 0 && sample.base[0] > 0))
    fail_at(table, path, "a deposition needs count and base");
  if (sample.kind == SampleKind::lattice) check_lattice(table, path, sample);
  if (sample.kind == SampleKind::body && sample.name.empty())
    fail_at(table, path + ".name", "missing; a body needs a name, under which its path is written");
  if (sample.from_file()) {
    check_file(table, path, folder, sample);
  } else {
    check_radii(table, path, sample.radii);
    check_room(table, path, sample);
  }
  if (const ClumpMaker clump = body_shapes().of(sample.shape).make; clump && scene.setup.clumps.empty())
    scene.setup.clumps.push_back(clump());
  if (sample.shape != BodyShape::sphere && sample.angular_velocity.norm() > 0)
    fail_at(*table.get("angular_velocity"), path + ".angular_velocity", "clumps begin without rotation");
  if (sample.kind == SampleKind::body) scene.setup.named.push_back({sample.name, BodyId{-1}});
  scene.samples.push_back(std::move(sample));
}

}  // namespace

void check_radii(const toml::table& table, const std::string& path, SizeDistribution& radii) {
  if (radii.kind == SizeDistribution::Kind::constant) radii.min = radii.max;
  if (radii.min > radii.max)
    fail_at(*table.get("radius_min"), path + ".radius_min",
            fmt::format("must not exceed radius_max: {} > {}", radii.min, radii.max));
  const std::string fault = fault_of(radii);
  if (fault.empty()) return;
  const bool sieve = radii.kind == SizeDistribution::Kind::sieve;
  const bool table_of_sizes = sieve || radii.kind == SizeDistribution::Kind::fractions;
  const std::string key = sieve ? "sieve_passing" : table_of_sizes ? "fraction_mass" : "radius_distribution";
  const toml::node* at = table.get(key);
  fail_at(at ? *at : table, path + "." + key, fault);
}

std::optional<Region> read_region(const toml::table& table, const std::string& path,
                                  std::initializer_list<Region::Kind> shapes) {
  const toml::node* node = table.get("region");
  if (!node) return std::nullopt;
  const std::string here = path + ".region";
  if (!node->is_table())
    fail_at(*node, here,
            "must be a table, e.g. region = { shape = \"box\", low = [0, 0, 0], high = [1, 1, 1] }");
  Region region;
  read_table(*node->as_table(), here, scene_keys().region, {}, region);
  if (std::find(shapes.begin(), shapes.end(), region.kind) == shapes.end()) {
    std::vector<std::string> names;
    const std::vector<std::string>& all = scene_keys().region.keys.front().choices;
    for (const Region::Kind kind : shapes) names.push_back(all[static_cast<std::size_t>(kind)]);
    fail_at(*node, here + ".shape",
            fmt::format("'{}' cannot be used here; these can: {}", all[static_cast<std::size_t>(region.kind)],
                        listed(names)));
  }
  if (const std::string fault = fault_of(region); !fault.empty()) fail_at(*node, here, fault);
  return region;
}

void read_samples(const toml::table& root, const std::filesystem::path& folder, Scene& scene) {
  const toml::node* node = root.get("sample");
  if (!node && root.get("insert")) return;
  if (!node) fail_at(root, "sample", "missing table [sample]; only a scene with an [[insert]] needs none");
  if (const toml::table* one = node->as_table()) return read_sample(*one, "sample", folder, scene);
  if (!node->is_array()) fail_at(*node, "sample", "must be a table: write [sample]");
  for (const toml::table* table : tables_at(root, "sample", "sample"))
    read_sample(*table, fmt::format("sample[{}]", scene.samples.size()), folder, scene);
}

}  // namespace talus::io::detail
