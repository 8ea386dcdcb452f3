/// Time to an error, by method: one step of a packing of spheres that begins cold. The baseline is plain NLGS
/// with the same instructions, in the same program.
///
///   bench_solvers SPHERES.csv [boxes|rcb|metis] [alternating|nscdd] [SUBDOMAINS...]
///
/// SPHERES.csv as for bench_coupling. Checks of the error are part of the time. Medians of three runs that
/// alternate.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "runtime/step/simulation.hpp"
#include "tests/bench/packed_scene.hpp"

namespace {

using namespace talus;

struct Case {
  const char* name;
  bool pile;
  double mu, tolerance;
};
constexpr Case cases[] = {{"triaxial", false, 0.35, 1e-3},
                          {"pile", true, 0.35, 1e-3},
                          {"pile", true, 0.35, 1e-4},
                          {"triaxial", false, 0.1, 1e-6},
                          {"triaxial", false, 0, 1e-6}};

/// A method of the settings, under the name of its rows.
struct Contender {
  const char* name;
  SolverMethod method;
  Precision precision = Precision::full;
};
constexpr Contender contenders[] = {{"NLGS", SolverMethod::nlgs},
                                    {"momentum", SolverMethod::momentum},
                                    {"NNCG", SolverMethod::nncg},
                                    {"auto, double", SolverMethod::automatic},
                                    {"auto", SolverMethod::automatic, Precision::mixed}};

struct Outcome {
  int sweeps = 0;
  bool reached = false;
  double error = 0, seconds = 0;
};

struct Cut {
  PartitionKind partitioner = PartitionKind::boxes;
  Coupling coupling = Coupling::alternating;
  int subdomains = 1;
};

Outcome solve(const bench::Packing& packing, const Case& problem, const Contender& method, const Cut& cut) {
  Setup setup = bench::packed_scene(packing, problem.pile, problem.tolerance, problem.mu);
  setup.solver.method = method.method;
  setup.solver.precision = method.precision;
  setup.solver.balance_tolerance = 1e9;
  setup.solver.max_iterations = 20000;
  setup.decomposition.subdomains = cut.subdomains;
  setup.decomposition.partitioner = cut.partitioner;
  setup.decomposition.coupling = cut.coupling;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, packing.bodies, executor);
  const StepReport& report = simulation.step();
  return {report.iterations, report.converged, report.error_rms, simulation.sums().times.iteration};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "bench_solvers SPHERES.csv [boxes|rcb|metis] [alternating|nscdd] [SUBDOMAINS...]\n");
    return 2;
  }
  const bench::Packing packing = bench::read_packing(argv[1]);
  std::vector<int> subdomains;
  Cut cut;
  const std::map<std::string, PartitionKind> partitioners = {
      {"boxes", PartitionKind::boxes}, {"rcb", PartitionKind::rcb}, {"metis", PartitionKind::metis}};
  const std::map<std::string, Coupling> couplings = {{"alternating", Coupling::alternating},
                                                     {"nscdd", Coupling::nscdd}};
  for (int k = 2; k < argc; ++k) {
    const std::string word = argv[k];
    if (partitioners.contains(word))
      cut.partitioner = partitioners.at(word);
    else if (couplings.contains(word))
      cut.coupling = couplings.at(word);
    else
      subdomains.push_back(std::stoi(word));
  }
  if (subdomains.empty()) subdomains = {1};
  for (const Case& problem : cases) {
    fmt::print("\n{}, mu {}, error {:g}, {} grains\n", problem.name, problem.mu, problem.tolerance,
               packing.bodies.size());
    fmt::print("| method | subdomains | sweeps | error | s | NLGS over it |\n");
    fmt::print("| --- | ---: | ---: | ---: | ---: | ---: |\n");
    double baseline = 0;
    for (const int count : subdomains)
      for (const Contender& method : contenders) {
        std::vector<Outcome> runs;
        for (int run = 0; run < 3; ++run)
          runs.push_back(solve(packing, problem, method, {cut.partitioner, cut.coupling, count}));
        std::sort(runs.begin(), runs.end(),
                  [](const Outcome& a, const Outcome& b) { return a.seconds < b.seconds; });
        const Outcome& median = runs[1];
        if (baseline == 0) baseline = median.seconds;
        fmt::print("| {} | {} | {}{} | {:.1e} | {:.3f} | {:.1f} |\n", method.name, count, median.sweeps,
                   median.reached ? "" : " (missed)", median.error, median.seconds,
                   baseline / median.seconds);
        std::fflush(stdout);
      }
  }
}
