#include "runtime/step/dealing.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "kernels/bodies/index.hpp"
#include "partition/partitioners.hpp"
#include "runtime/step/exact_sum.hpp"

namespace talus {

namespace {

/// Grains sent at a time, to all receivers together: less than a megabyte.
constexpr std::size_t dealt_at_once = 8192;

/// A grain as it is sent.
struct GrainRecord {
  std::int64_t id;
  double x[3], radius, density;
  double velocity[6];
  std::int64_t material;
};

GrainRecord record_of(const Sample& sample, std::size_t k) {
  GrainRecord record{};
  record.id = static_cast<std::int64_t>(sample.id_of(k));
  std::copy_n(sample.x[k].data(), 3, record.x);
  record.radius = sample.radius[k];
  record.density = sample.density_of(k);
  if (!sample.material.empty()) record.material = sample.material[k];
  if (!sample.velocity.empty()) std::copy_n(sample.velocity[k].begin(), 6, record.velocity);
  return record;
}

/// Properties of a whole sample, sent once.
struct SampleKind {
  std::int64_t grains;
  bool materials;
  GrainKind grain;
};

void add(const GrainRecord& record, const SampleKind& kind, Bodies& bodies) {
  add_grain(bodies,
            {BodyId{record.id}, {record.x[0], record.x[1], record.x[2]}, record.radius, record.density},
            kind.grain);
  if (kind.materials) bodies.material.push_back(static_cast<Material>(record.material));
  std::copy_n(record.velocity, 3, bodies.velocity.back().u);
  if (kind.grain.rotates) std::copy_n(record.velocity + 3, 3, bodies.velocity.back().w);
}

/// Rank of each grain: that of the subdomain its centre is in.
std::vector<std::int32_t> receivers(Sample& sample, const DecompositionSettings& settings,
                                    const graph::Communicator& ranks) {
  const Decomposition decomposition = make_decomposition(settings, ranks);
  PartitionPoints points;
  points.x.swap(sample.x);
  if (partitioner_registry().of(settings.partitioner).make->reads_halves)
    points.half.assign(points.x.size(), Vec3::Zero());
  const Partition partition = make_partition(
      points, partition_options(settings, decomposition.partition.subdomains), reduction_over(ranks));
  points.x.swap(sample.x);
  std::vector<std::int32_t> rank(sample.size());
  for (std::size_t k = 0; k < rank.size(); ++k)
    rank[k] = decomposition.rank_of[partition.subdomain_of(sample.x[k])];
  return rank;
}

}  // namespace

Bodies deal_out(Sample sample, const DecompositionSettings& settings, const graph::Communicator& ranks) {
  Bodies bodies;
  if (ranks.ranks() == 1) {
    reserve(bodies, sample.size());
    append(sample, bodies);
    return bodies;
  }
  const SampleKind own{static_cast<std::int64_t>(sample.size()),
                       !sample.material.empty(),
                       {sample.shape, sample.seed, sample.rotates}};
  const SampleKind all = ranks.gather_records(std::span<const SampleKind>(&own, 1)).front();
  const std::vector<std::int32_t> rank = receivers(sample, settings, ranks);
  std::vector<std::int64_t> count(static_cast<std::size_t>(ranks.ranks()), 0);
  for (std::int32_t to : rank) ++count[static_cast<std::size_t>(to)];
  ranks.sum(count);
  reserve(bodies, static_cast<std::size_t>(count[static_cast<std::size_t>(ranks.rank())]));
  for (std::size_t begin = 0; begin < static_cast<std::size_t>(all.grains); begin += dealt_at_once) {
    std::vector<std::vector<GrainRecord>> to(count.size());
    for (std::size_t k = begin; k < std::min(begin + dealt_at_once, sample.size()); ++k)
      to[static_cast<std::size_t>(rank[k])].push_back(record_of(sample, k));
    for (const auto& part : ranks.exchange_records(std::move(to)))
      for (const GrainRecord& record : part) add(record, all, bodies);
  }
  return bodies;
}

SampleSize measure_sample(const Bodies& own, const graph::Communicator& ranks, std::span<const Clump> clumps,
                          const Decomposition* dealt) {
  const auto volume_of = [](double radius) { return sphere_mass(radius, 1); };
  const ClumpView shapes{own.shape, own.orientation, clumps};
  // First the maxima over all ranks; the smallest radius as its negative. The last two are flags.
  std::array<double, 5> most{0, -std::numeric_limits<double>::infinity(), 0,
                             own.orientation.empty() ? 0.0 : 1.0, own.material.empty() ? 0.0 : 1.0};
  std::vector<Slot> measured;
  for (std::size_t k = 0; k < own.size(); ++k)
    if (dealt == nullptr || counts(*dealt, k)) measured.push_back(static_cast<Slot>(k));
  const auto mass_of = [&](std::size_t k) {
    const double inverse =
        dealt == nullptr ? own.velocity[k].inv_mass : whole_velocity(*dealt, own, k).inv_mass;
    return inverse > 0 ? 1 / inverse : 0;
  };
  for (const Slot slot : measured) {
    const std::size_t k = at(slot);
    most[0] = std::max(most[0], own.radius[k]);
    most[1] = std::max(most[1], shapes.is_clump(k) ? -own.radius[k] * shapes.of(k).smallest : -own.radius[k]);
    most[2] = std::max(most[2], mass_of(k));
  }
  ranks.max(most);
  ExactSum diameter(2 * most[0]), volume(volume_of(most[0])), mass(most[2]);
  for (const Slot slot : measured) {
    const std::size_t k = at(slot);
    diameter.add(2 * own.radius[k]);
    volume.add(shapes.is_clump(k) ? own.radius[k] * own.radius[k] * own.radius[k] * shapes.of(k).volume
                                  : volume_of(own.radius[k]));
    mass.add(mass_of(k));
  }
  std::int64_t bodies[1] = {static_cast<std::int64_t>(measured.size())};
  ranks.sum(bodies);
  SampleSize size;
  size.bodies = bodies[0];
  size.smallest = -most[1];
  size.mean_diameter = diameter.over(ranks) / static_cast<double>(std::max<std::int64_t>(size.bodies, 1));
  size.volume = volume.over(ranks);
  size.total_mass = mass.over(ranks);
  size.orientation = most[3] > 0;
  size.materials = most[4] > 0;
  return size;
}

}  // namespace talus
