/// Table 4 of Visseq, Alart and Dureisseix (2013) for every partitioner on a dense sample: load and interface
/// of the subdomains, time to partition, and the grains that migrate when the sample has deformed a little.
/// Usage: bench_partition [grains, default 200000 | RESULTS.h5] [subdomains, default 96]
/// With grains they are deposited; with the results of a run its last frame is taken, grains and walls.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "io/results/results.hpp"
#include "kernels/detection/broad_phase.hpp"
#include "kernels/samples/sample.hpp"
#include "partition/interface.hpp"
#include "partition/load_table.hpp"
#include "partition/partitioner.hpp"

namespace {

using namespace talus;

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

struct Dense {
  std::vector<Vec3> x;
  std::vector<double> radii;
  std::vector<GrainPair> grain_pairs;
  std::vector<WallPair> wall_pairs;
};

/// Pairs whose surfaces are nearer than `margin` [m], and those of the walls of the box [low, high].
void find_contacts(Dense& sample, double margin, const Vec3& low, const Vec3& high) {
  std::vector<double> reach = sample.radii;
  for (double& r : reach) r += margin / 2;
  const CellGrid grid = build_cells(sample.x, reach);
  std::vector<std::vector<GrainPair>> parts(1);
  find_pairs(grid, 0, grid.cells.size(), parts[0]);
  sample.grain_pairs = sort_pairs(parts, sample.x.size());
  for (std::int32_t wall = 0; wall < 6; ++wall)
    for (std::size_t k = 0; k < sample.x.size(); ++k) {
      const double coordinate = sample.x[k][wall / 2];
      const double gap =
          (wall % 2 == 0 ? coordinate - low[wall / 2] : high[wall / 2] - coordinate) - sample.radii[k];
      if (gap < margin) sample.wall_pairs.push_back({wall, static_cast<Slot>(k)});
    }
}

/// A deposited packing cut level at the top, as the lid of a compaction leaves it, with six walls. Pairs
/// nearer than `margin` of the mean radius count as contacts.
Dense deposited(std::size_t grains, double margin) {
  Dense sample;
  const auto drawn = draw_radii({SizeDistribution::Kind::uniform, 10.0 / 11, 12.0 / 11}, grains * 21 / 20, 1);
  const double length = std::cbrt(static_cast<double>(grains) * 4.18879 / 0.62);
  const auto centres = deposit(drawn, length, length);
  std::vector<double> heights;
  for (std::size_t k = 0; k < drawn.size(); ++k) heights.push_back(centres[k][2] + drawn[k]);
  std::nth_element(heights.begin(), heights.begin() + static_cast<std::ptrdiff_t>(grains - 1), heights.end());
  const double top = heights[grains - 1];
  for (std::size_t k = 0; k < drawn.size(); ++k) {
    if (centres[k][2] + drawn[k] > top) continue;
    sample.x.push_back(centres[k]);
    sample.radii.push_back(drawn[k]);
  }
  find_contacts(sample, margin, Vec3::Zero(), Vec3(length, length, top));
  return sample;
}

/// The last frame of a run in a box; pairs nearer than a tenth of the smallest radius count as contacts, as
/// in the run.
Dense compacted(const std::string& results) {
  const Frame frame = io::read_frame(results, io::frame_count(results) - 1);
  Dense sample;
  sample.x = frame.x;
  sample.radii = frame.radius;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  for (const WallReport& wall : frame.walls) {
    if (wall.name.size() != 2) continue;  // x-, x+, ...: the sides of a box
    const Eigen::Index axis = wall.name[0] - 'x';
    if (wall.name[1] == '-')
      low[axis] = wall.position;
    else
      high[axis] = -wall.position;
  }
  const double smallest = *std::min_element(sample.radii.begin(), sample.radii.end());
  find_contacts(sample, 0.1 * smallest, low, high);
  double volume = 0;
  for (double r : sample.radii) volume += 4.18879 * r * r * r;
  std::printf("# step %lld, solid fraction %.4f\n", static_cast<long long>(frame.step),
              volume / (high - low).prod());
  return sample;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "200000";
  const auto subdomains = static_cast<std::int32_t>(argc > 2 ? std::stoi(argv[2]) : 96);
  auto begin = std::chrono::steady_clock::now();
  const Dense sample =
      what.ends_with(".h5") ? compacted(what) : deposited(static_cast<std::size_t>(std::stol(what)), 0.05);
  const std::size_t contacts = sample.grain_pairs.size() + sample.wall_pairs.size();
  std::printf("# %zu grains, %zu contacts (%zu at walls), sample in %.1f s\n", sample.x.size(), contacts,
              sample.wall_pairs.size(), seconds_since(begin));

  std::vector<BodyId> id;
  for (std::size_t k = 0; k < sample.x.size(); ++k) id.push_back(BodyId{static_cast<std::int64_t>(k)});
  const FirstNumbers<SubdomainId> numbers(static_cast<std::size_t>(subdomains));
  const std::vector<SubdomainId> all(numbers.begin(), numbers.end());
  const auto points = candidate_points(sample.x, sample.grain_pairs, sample.wall_pairs);
  // The same contacts after a shear of 0.1 % and a compression of 0.05 %.
  std::vector<Vec3> moved;
  for (const Vec3& x : sample.x) moved.push_back({x[0] + 1e-3 * x[2], x[1], x[2] * (1 - 5e-4)});
  const auto moved_points = candidate_points(moved, sample.grain_pairs, sample.wall_pairs);

  const std::array<PartitionKind, 4> kinds{PartitionKind::boxes, PartitionKind::fitted, PartitionKind::rcb,
                                           PartitionKind::metis};
  std::vector<std::string_view> names;
  std::vector<LoadTable> tables;
  std::puts(
      "partitioner,partition_s,interfaces_s,imbalance_percent,migrants_same_planes,migrants_new_planes,"
      "bytes");
  for (PartitionKind kind : kinds) {
    PartitionOptions options;
    options.kind = kind;
    options.subdomains = subdomains;
    begin = std::chrono::steady_clock::now();
    const Partition partition = make_partition(points, options);
    const double cutting = seconds_since(begin);
    begin = std::chrono::steady_clock::now();
    const auto standings_of = [&](const Partition& regions, const PartitionPoints& at) {
      const auto subdomain = subdomains_of(regions, at.x);
      return grain_subdomains(sample.x.size(), sample.grain_pairs, sample.wall_pairs, subdomain);
    };
    const BodySubdomains incidences = standings_of(partition, points);
    const auto interfaces = build_interfaces(incidences, id, all);
    const double building = seconds_since(begin);
    const auto subdomain = subdomains_of(partition, points.x);
    const auto walls =
        wall_subdomains(6, sample.wall_pairs, std::span(subdomain).subspan(sample.grain_pairs.size()));
    names.push_back(name_of(kind));
    tables.push_back(measure_load(subdomains, interfaces, incidences, walls, subdomain));

    const auto migrants = [&](const BodySubdomains& now) {
      long long bodies = 0;
      for (std::size_t k = 0; k < sample.x.size(); ++k) {
        const auto before = incidences.of(k), after = now.of(k);
        bodies += !std::includes(before.begin(), before.end(), after.begin(), after.end());
      }
      return bodies;
    };
    const long long same = migrants(standings_of(partition, moved_points));
    options.previous = &partition;
    const Partition next = make_partition(moved_points, options);
    const long long anew = migrants(standings_of(next, moved_points));
    std::printf("%s,%.3f,%.3f,%.2f,%lld,%lld,%zu\n", name_of(kind).data(), cutting, building,
                100 * imbalance(tables.back().contacts), same, anew, memory_used(partition));
  }
  std::fputs(load_text(names, tables).c_str(), stdout);
}
