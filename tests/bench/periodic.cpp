/// What a step in a periodic cell costs beside one between walls, and what subdomains cost in sweeps there.
/// Grains of a cubic lattice that touch, with random velocities; as many sweeps in every step. Kinds take
/// turns, step by step, so that what else the machine does falls on all of them.
///
/// Usage: bench_periodic [edge of the cube in grains, default 25] [steps, default 15] [sweeps, default 60]
///                       [subdomains, default 96; 0: only the cost of steps]

#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "apps/shared/median.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/bench/clocks.hpp"

namespace {

using namespace talus;

constexpr double radius = 0.5, speed = 0.05;  // in diameters, density 1
constexpr double pressure = 1;

enum class Kind { walls, at_rest, sheared, stressed };

struct Case {
  Kind kind;
  const char* name;
};
constexpr Case cases[] = {{Kind::walls, "walls"},
                          {Kind::at_rest, "cell at rest"},
                          {Kind::sheared, "cell sheared at a rate"},
                          {Kind::stressed, "cell under a stress"}};

Setup setup_of(Kind kind, int edge) {
  Setup setup;
  setup.stages.resize(1);
  Stage& stage = setup.stages.front();
  stage.name = "all";
  stage.time_step = 1e-2;
  stage.end.steps = 1 << 30;
  stage.laws.set_all(&PairLaw::friction, 0.3);
  setup.decomposition.subdomains = 1;
  const double length = 2 * radius * edge;
  if (kind == Kind::walls) {
    for (int side = 0; side < 6; ++side) {
      Wall& wall = setup.walls.emplace_back();
      wall.name = fmt::format("{}", side);
      wall.normal = (side % 2 == 0 ? 1 : -1) * Vec3::Unit(side / 2);
      wall.point = side % 2 == 0 ? Vec3(Vec3::Zero()) : Vec3(Vec3::Constant(length));
    }
    return setup;
  }
  setup.domain = periodic_domain(Vec3::Constant(length));
  if (kind != Kind::at_rest) stage.shear_rates = {0, 1e-3, 0};
  if (kind == Kind::stressed) {
    for (std::size_t k = 0; k < 3; ++k) stage.stress.to[k] = pressure;
    setup.decomposition.coupling = Coupling::nscdd;
  }
  return setup;
}

Sample sample_of(int edge) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> part(-speed, speed);
  Sample sample;
  sample.density = 1;
  for (int z = 0; z < edge; ++z)
    for (int y = 0; y < edge; ++y)
      for (int x = 0; x < edge; ++x) {
        sample.x.push_back(2 * radius * Vec3(x + 0.5, y + 0.5, z + 0.5));
        sample.radius.push_back(radius);
        sample.velocity.push_back({part(random), part(random), part(random), 0, 0, 0});
      }
  return sample;
}

std::unique_ptr<Simulation> simulation_of(const Setup& setup, int edge, graph::Executor& executor) {
  const graph::Communicator& alone = graph::one_rank();
  return std::make_unique<Simulation>(setup, deal_out(sample_of(edge), setup.decomposition, alone), executor,
                                      alone);
}

/// Steps of so many sweeps; with `renew` each finds its candidates anew.
void compare_steps(int edge, int steps, int sweeps, bool renew, graph::Executor& executor) {
  std::vector<std::unique_ptr<Simulation>> all;
  for (const auto& [kind, name] : cases) {
    Setup setup = setup_of(kind, edge);
    setup.solver.tolerance = 1e-14;
    setup.solver.balance_tolerance = 1e9;  // no step asks for more than its sweeps
    setup.solver.method = SolverMethod::momentum;
    setup.solver.max_iterations = sweeps;
    if (renew) setup.detection.skin = 1e-9;
    all.push_back(simulation_of(setup, edge, executor));
    all.back()->step();
  }
  std::vector<std::vector<double>> seconds(all.size()), ratios(all.size());
  for (int step = 0; step < steps; ++step) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double begun = bench::cpu_now();
      all[k]->step();
      seconds[k].push_back(bench::cpu_now() - begun);
    }
    for (std::size_t k = 0; k < all.size(); ++k) ratios[k].push_back(seconds[k].back() / seconds[0].back());
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    fmt::print("{},{},{},{},{},{:.5f},{:.3f}\n", edge * edge * edge, cases[k].name,
               renew ? "every step" : "rare", all[k]->report().iterations, all[k]->report().contacts,
               median(seconds[k]), median(ratios[k]));
}

/// Sweeps to the default tolerances, of all steps.
void compare_subdomains(int edge, int steps, int subdomains, graph::Executor& executor) {
  fmt::print("\ngrains,kind,coupling,subdomains,sweeps,missed steps\n");
  for (const auto& [kind, name] : cases) {
    for (const int n : {1, subdomains}) {
      Setup setup = setup_of(kind, edge);
      setup.decomposition.subdomains = n;
      const auto simulation = simulation_of(setup, edge, executor);
      long sweeps = 0, missed = 0;
      for (int step = 0; step < steps; ++step) {
        const StepReport& report = simulation->step();
        sweeps += report.iterations;
        missed += report.converged ? 0 : 1;
      }
      fmt::print("{},{},{},{},{},{}\n", edge * edge * edge, name,
                 couplings().of(setup.decomposition.coupling).name, n, sweeps, missed);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int place, int otherwise) {
    return argc > place ? std::atoi(argv[place]) : otherwise;
  };
  const int edge = number(1, 25), steps = number(2, 15), sweeps = number(3, 60), subdomains = number(4, 96);
  graph::Executor executor({.threads = 1});
  fmt::print(
      "grains,kind,broad phase,sweeps,contacts,seconds of processor a step (median),over walls (median of "
      "ratios)\n");
  for (const bool renew : {false, true}) compare_steps(edge, steps, sweeps, renew, executor);
  if (subdomains > 1) compare_subdomains(edge, steps, subdomains, executor);
  return 0;
}
