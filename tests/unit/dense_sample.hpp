#pragma once

/// Samples that the kernels' tests share: grains close enough to touch, and the arrays of one step around
/// them.

#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kernels/bodies/bodies.hpp"
#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/chunks.hpp"
#include "kernels/detection/narrow_phase.hpp"
#include "kernels/shapes/walls.hpp"
#include "kernels/sweeps/sweep.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/step/setup.hpp"
#include "tests/unit/reference_sweeps.hpp"

namespace talus::test {

using Random = std::mt19937_64;

/// Why tests that compare instruction sets are skipped.
inline constexpr const char* no_other_instruction_set =
    "this processor has neither AVX2 nor AVX-512: there is nothing to compare the portable kernels with";

/// What this processor runs, the portable set first.
inline std::vector<InstructionSet> sets_to_test() {
  std::vector<InstructionSet> sets;
  for (const InstructionSet set : {InstructionSet::portable, InstructionSet::avx2, InstructionSet::avx512})
    if (set <= best_instruction_set()) sets.push_back(set);
  return sets;
}

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline Vec3 uniform_vector(Random& random, double low, double high) {
  const double x = uniform(random, low, high), y = uniform(random, low, high);
  return {x, y, uniform(random, low, high)};
}

/// edge^3 spheres of radius 0.45-0.6 m near the points of a cubic lattice of spacing 1 m: about six contacts
/// each, some of them deep. Speeds up to `speed` [m/s], radii and masses all different. Morton order.
inline Bodies jittered_lattice(int edge, std::uint64_t seed, double speed = 1) {
  Random random(seed);
  Bodies bodies;
  for (int k = 0; k < edge * edge * edge; ++k) {
    const Vec3 site(k % edge, k / edge % edge, k / (edge * edge));
    add_sphere(bodies, BodyId{k}, site + uniform_vector(random, -0.08, 0.08), uniform(random, 0.45, 0.6),
               uniform(random, 1000, 3000));
    for (double& u : bodies.velocity.back().u) u = uniform(random, -speed, speed);
    for (double& w : bodies.velocity.back().w) w = uniform(random, -speed, speed);
  }
  reorder(bodies, morton_order(bodies));
  return bodies;
}

/// The six walls of the box [low, high]^3, fixed: x-, x+, y-, y+, z-, z+.
inline std::vector<Wall> box_of_walls(double low, double high) {
  std::vector<Wall> walls;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      Wall wall;
      wall.name = std::string(1, "xyz"[axis]) + (side > 0 ? "-" : "+");
      wall.normal = side * Vec3::Unit(axis);
      wall.point = Vec3::Unit(axis) * (side > 0 ? low : high);
      walls.push_back(wall);
    }
  return walls;
}

/// One stage in a box of walls whose lid and two sides press with `pressure` [Pa] and weigh `wall_mass` [kg].
inline talus::Setup pressed_setup(std::vector<Wall> box, double friction, std::int64_t steps, double pressure,
                                  double wall_mass) {
  talus::Setup setup;
  setup.walls = std::move(box);
  Stage stage;
  stage.name = "press";
  stage.time_step = 1e-3;
  stage.laws = laws_of_one_material(friction, friction, 0);
  stage.end.steps = steps;
  WallLoad load;
  load.drive = WallDrive::pressure;
  load.pressure = pressure;
  load.mass = wall_mass;
  for (const char* name : {"x+", "y+", "z+"}) stage.loads.push_back({name, load});
  setup.stages = {stage};
  return setup;
}

/// Every pair with |x_i - x_j| < reach_i + reach_j, by looking at all of them; in order of (first, second).
inline std::vector<GrainPair> pairs_by_brute_force(std::span<const Vec3> x, std::span<const double> reach) {
  std::vector<GrainPair> pairs;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = i + 1; j < x.size(); ++j) {
      const double distance = reach[i] + reach[j];
      if ((x[i] - x[j]).squaredNorm() < distance * distance)
        pairs.push_back({static_cast<Slot>(i), static_cast<Slot>(j)});
    }
  return pairs;
}

inline Candidates find_candidates(const Bodies& bodies, const std::vector<Wall>& walls, double margin,
                                  bool friction) {
  std::vector<double> reach = bodies.radius;
  for (double& r : reach) r += margin;
  const CellGrid grid = build_cells(bodies.x, reach);
  std::vector<std::vector<GrainPair>> parts(1);
  find_pairs(grid, 0, grid.cells.size(), parts[0]);
  Candidates candidates;
  candidates.impulse = KeptImpulses(friction ? ImpulseKind::force : ImpulseKind::normal);
  candidates.grain_pairs = sort_pairs(parts, bodies.size());
  for (std::size_t w = 0; w < walls.size(); ++w)
    for (std::size_t s = 0; s < bodies.size(); ++s)
      if (walls[w].normal.dot(bodies.x[s] - walls[w].point) < reach[s] + margin)
        candidates.wall_pairs.push_back({static_cast<std::int32_t>(w), static_cast<Slot>(s)});
  candidates.impulse.assign_zeros(candidates.size());
  return candidates;
}

/// All that a sweep needs.
struct Sample {
  Bodies bodies;
  std::vector<Wall> walls;
  Candidates candidates;
  Chunks chunks;
  Contacts contacts;

  ContactRange range(std::size_t chunk) const {
    const auto begin = static_cast<std::size_t>(chunks.begin[chunk]);
    return {begin, begin + static_cast<std::size_t>(contacts.count[chunk])};
  }
};

/// Narrow phase over all chunks with h = 1 ms and the given alert distance; biases as IQS gives them.
inline void find_contacts(Sample& sample, double alert, InstructionSet set = InstructionSet::automatic) {
  allocate(sample.contacts, sample.candidates, sample.chunks,
           sample.candidates.impulse.kind() == ImpulseKind::force);
  const NarrowPhase in{
      sample.bodies.x, sample.bodies.radius, sample.bodies.velocity, sample.walls, 1e-3, alert, {},
      Vec3::Zero()};
  for (std::size_t c = 0; c < sample.chunks.size(); ++c)
    narrow_chunk(in, sample.candidates, sample.chunks, c, set, sample.contacts);
}

inline Sample dense_sample(int edge, std::uint64_t seed, bool friction, bool with_walls, int chunk_target) {
  Sample sample;
  sample.bodies = jittered_lattice(edge, seed);
  if (with_walls) sample.walls = box_of_walls(-0.5, edge - 0.5);
  sample.candidates = find_candidates(sample.bodies, sample.walls, 0.1, friction);
  sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), chunk_target);
  find_contacts(sample, 0.1);
  return sample;
}

}  // namespace talus::test
