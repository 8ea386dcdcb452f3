#pragma once

/// Pressed boxes cut into subdomains in all ways, and what comes of them.

#include <utility>
#include <vector>

#include "runtime/step/simulation.hpp"
#include "tests/unit/dense_sample.hpp"

namespace talus::decomposition_test {

using test::Random;
using test::uniform;

struct Variant {
  const char* name;
  Coupling coupling;
  ExchangeScheme exchange;
  PartitionKind partitioner;
};
inline const std::vector<Variant> variants = {
    {"nscdd, dcs, boxes", Coupling::nscdd, ExchangeScheme::dcs, PartitionKind::boxes},
    {"nscdd, ccs, rcb", Coupling::nscdd, ExchangeScheme::ccs, PartitionKind::rcb},
    {"nscdd, dcs, metis", Coupling::nscdd, ExchangeScheme::dcs, PartitionKind::metis},
    {"alternating, dcs, boxes", Coupling::alternating, ExchangeScheme::dcs, PartitionKind::boxes},
    {"alternating, dcs, metis", Coupling::alternating, ExchangeScheme::dcs, PartitionKind::metis},
    {"alternating, ccs, rcb", Coupling::alternating, ExchangeScheme::ccs, PartitionKind::rcb},
    {"schwarz, dcs, fitted", Coupling::schwarz, ExchangeScheme::dcs, PartitionKind::fitted},
    {"schwarz, ccs, boxes", Coupling::schwarz, ExchangeScheme::ccs, PartitionKind::boxes},
};

/// 6 x 6 x 6 grains in a box whose lid and two sides press with 20 kPa.
inline talus::Setup pressed_box(double friction, std::int64_t steps) {
  return test::pressed_setup(test::box_of_walls(0, 6 * 0.021), friction, steps, 2e4, 1);
}

inline Bodies lattice(int edge, std::uint64_t seed) {
  Random random(seed);
  Bodies bodies;
  for (int k = 0; k < edge * edge * edge; ++k) {
    const Vec3 site(k % edge + 0.5, k / edge % edge + 0.5, k / (edge * edge) + 0.5);
    add_sphere(bodies, BodyId{k}, 0.021 * site + test::uniform_vector(random, -4e-4, 4e-4),
               uniform(random, 0.008, 0.01), 2600);
  }
  return bodies;
}

inline void choose(talus::Setup& setup, const Variant& variant, int subdomains) {
  setup.decomposition.coupling = variant.coupling;
  setup.decomposition.exchange = variant.exchange;
  setup.decomposition.partitioner = variant.partitioner;
  setup.decomposition.subdomains = subdomains;
}

struct Outcome {
  std::uint64_t digest = 0;
  StepReport last;
  std::vector<WallReport> walls;
  std::int64_t unconverged = 0, migrants = 0;
  double coordination = 0;
};

inline Outcome run(const talus::Setup& setup, Bodies bodies,
                   graph::ExecutorOptions options = {.threads = 1}) {
  graph::Executor executor(options);
  Simulation simulation(setup, std::move(bodies), executor);
  Outcome outcome;
  while (!simulation.finished()) {
    outcome.last = simulation.step();
    if (!outcome.last.converged) ++outcome.unconverged;
    outcome.migrants += outcome.last.migrants;
    outcome.walls = simulation.walls();
    if (const auto triaxial = simulation.triaxial()) outcome.coordination = triaxial->coordination;
    simulation.begin_next_stage();
  }
  outcome.digest = simulation.digest();
  return outcome;
}

}  // namespace talus::decomposition_test
