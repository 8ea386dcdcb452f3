#include "apps/shared/sample_join.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "kernels/bodies/release.hpp"
#include "kernels/detection/images.hpp"

namespace talus {

namespace {

/// Overlaps of grains of two samples below this part of the smaller radius are rounding.
constexpr double rounding = 1e-6;

std::string name_of(const io::Scene& scene, std::size_t k) {
  const std::string& name = scene.samples[k].name;
  return name.empty() ? fmt::format("{}", k) : fmt::format("{} ('{}')", k, name);
}

void refuse_overlaps(const io::Scene& scene, const Sample& sample, const std::vector<std::size_t>& part_of) {
  const Domain& domain = scene.setup.domain;
  std::size_t count = 0;
  double worst = 0;
  GrainPair deepest{};
  for (const GrainPair& pair : near_pairs(domain, sample.x, sample.radius)) {
    const std::size_t a = at(pair.first), b = at(pair.second);
    if (part_of[a] == part_of[b]) continue;
    const double depth =
        sample.radius[a] + sample.radius[b] - domain.separation(sample.x[a], sample.x[b]).norm();
    if (depth <= rounding * std::min(sample.radius[a], sample.radius[b])) continue;
    ++count;
    if (depth > worst) {
      worst = depth;
      deepest = pair;
    }
  }
  if (count == 0) return;
  throw io::error_in(
      scene, io::key_of_sample(scene, part_of[at(deepest.second)]),
      fmt::format(
          "samples {} and {} overlap: {} pairs of grains of different samples, the deepest by {:.3g} m. "
          "Move one of them (origin, position, region), or make it smaller",
          name_of(scene, part_of[at(deepest.first)]), name_of(scene, part_of[at(deepest.second)]), count,
          worst));
}

void refuse_same_ids(const io::Scene& scene, const Sample& sample) {
  std::vector<BodyId> ids = sample.id;
  std::ranges::sort(ids);
  const auto twice = std::ranges::adjacent_find(ids);
  if (twice == ids.end()) return;
  throw io::error_in(scene, "sample",
                     fmt::format("two samples have a body {}: give those of one file other ids",
                                 static_cast<std::int64_t>(*twice)));
}

}  // namespace

Sample join_samples(const io::Scene& scene, std::vector<Sample> parts) {
  Sample all;
  if (!parts.empty()) {
    all.density = parts.back().density;
    all.rotates = parts.back().rotates;
    all.shape = parts.back().shape;
    all.seed = parts.back().seed;
    all.material_density = parts.back().material_density;
  }
  const bool moving = std::ranges::any_of(parts, [](const Sample& part) { return !part.velocity.empty(); });
  std::vector<std::size_t> part_of;
  std::int64_t next = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    Sample& part = parts[p];
    const std::int64_t first = next;
    for (std::size_t k = 0; k < part.size(); ++k) {
      const std::int64_t id =
          part.id.empty() ? first + static_cast<std::int64_t>(k) : static_cast<std::int64_t>(part.id[k]);
      all.id.push_back(BodyId{id});
      next = std::max(next, id + 1);
    }
    for (const BodyId named : part.named)
      all.named.push_back(BodyId{first + static_cast<std::int64_t>(named)});
    if (moving) part.velocity.resize(part.size());
    all.velocity.insert(all.velocity.end(), part.velocity.begin(), part.velocity.end());
    all.material.insert(all.material.end(), part.material.begin(), part.material.end());
    all.radius.insert(all.radius.end(), part.radius.begin(), part.radius.end());
    all.x.insert(all.x.end(), part.x.begin(), part.x.end());
    part_of.insert(part_of.end(), part.size(), p);
    part = {};
  }
  refuse_same_ids(scene, all);
  refuse_overlaps(scene, all, part_of);
  return all;
}

}  // namespace talus
