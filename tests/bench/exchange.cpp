/// Table 1 of Visseq, Alart and Dureisseix (2013) on a dense packing under isotropic compaction: messages and
/// bytes of an iteration with centralised (CCS) and decentralised (DCS) exchange, and the part of the
/// iterations that ranks waited for messages. Then the share of a run that partition and migration take.
///
///   bench_exchange SCENE.toml [STEPS] [SWEEPS] [SUBDOMAINS]
///   mpirun -n 2 bench_exchange SCENE.toml ...
///
/// SCENE: its first stage is run, frictionless if that is, from the sample as the scene makes it. STEPS: 10
/// without it. SWEEPS a step: 200; 0: as many as the scene's tolerance asks for. SUBDOMAINS: all rows of the
/// table. Waited: median over the steps, of the rank that waited most.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "apps/shared/sample_builder.hpp"
#include "io/scene/scene.hpp"
#include "runtime/graph/mpi_communicator.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"

namespace {

using namespace talus;

/// Number of subdomains, the paper's grid and its percentages.
struct Row {
  std::array<std::int64_t, 3> boxes;
  double paper_ccs, paper_dcs;  ///< [%] of the time in exchanges
};

struct Measured {
  MessageCount messages;
  double waited = 0;                  ///< over the time of the iterations, of the rank that waited most
  double dealing = 0, detection = 0;  ///< over the time of the steps
  std::int64_t broad_phases = 0, migrants = 0;
};

Measured measure(const Setup& setup, const Sample& sample, std::int64_t steps,
                 const graph::Communicator& ranks) {
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, deal_out(sample, setup.decomposition, ranks), executor, ranks);
  Measured result;
  std::vector<double> waited;
  double dealing = 0, detecting = 0, all = 0;
  for (std::int64_t k = 0; k < steps && !simulation.finished(); ++k) {
    const StepReport& report = simulation.step();
    const StepTimes& times = simulation.sums().times;
    double share[1] = {simulation.exposed() / times.iteration};
    ranks.max(share);
    waited.push_back(share[0]);
    dealing += times.dealing;
    detecting += times.detection;
    all += times.detection + times.iteration + times.rest;
    result.broad_phases += simulation.sums().broad_phase ? 1 : 0;
    result.migrants += report.migrants;
    simulation.begin_next_stage();
  }
  result.messages = simulation.messages();
  std::nth_element(waited.begin(), waited.begin() + static_cast<std::ptrdiff_t>(waited.size() / 2),
                   waited.end());
  result.waited = waited[waited.size() / 2];
  double most[2] = {dealing / all, detecting / all};
  ranks.max(most);
  result.dealing = most[0];
  result.detection = most[1];
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const graph::MpiSession session(&argc, &argv);
  const auto world = graph::make_communicator(session);
  const graph::Communicator& ranks = *world;
  if (argc < 2) {
    if (ranks.rank() == 0) fmt::print(stderr, "bench_exchange SCENE.toml [STEPS] [SWEEPS]\n");
    return 2;
  }
  const std::int64_t steps = argc > 2 ? std::atol(argv[2]) : 10;
  io::Scene scene = io::load_scene(argv[1]);
  Sample sample = build_sample(scene);
  io::place_walls(scene, sample);
  if (ranks.rank() != 0) sample = {};
  Setup setup = scene.setup;
  setup.stages.resize(1);
  setup.solver.method = SolverMethod::nlgs;
  const int sweeps = argc > 3 ? std::atoi(argv[3]) : 200;
  const int only = argc > 4 ? std::atoi(argv[4]) : 0;
  if (sweeps > 0) {
    setup.solver.max_iterations = sweeps;
    setup.solver.tolerance = 1e-12;  // every step does all of them
  }
  setup.decomposition.partitioner = PartitionKind::boxes;

  const std::array<Row, 5> rows{
      {{{1, 1, 2}, 6, 2}, {{1, 2, 2}, 25, 3}, {{2, 2, 2}, 47, 9}, {{2, 2, 3}, 57, 10}, {{2, 2, 4}, 69, 16}}};
  const auto say = [&](const std::string& text) {
    if (ranks.rank() == 0) fmt::print("{}", text);
    std::fflush(stdout);
  };
  say(fmt::format("{}, {} ranks, {} steps of {} sweeps\n", scene.name, ranks.ranks(), steps,
                  sweeps > 0 ? std::to_string(sweeps) : "as many as needed"));
  say("| subdomains | coupling | exchange | messages | kB | between ranks | kB | waited | paper | dealing | "
      "detection | dealt out | migrants |\n"
      "| ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n");
  for (const Row& row : rows)
    for (const Coupling coupling : {Coupling::nscdd, Coupling::schwarz})
      for (const ExchangeScheme exchange : {ExchangeScheme::ccs, ExchangeScheme::dcs}) {
        const bool central = exchange == ExchangeScheme::ccs;
        setup.decomposition.boxes = row.boxes;
        setup.decomposition.subdomains = static_cast<int>(row.boxes[0] * row.boxes[1] * row.boxes[2]);
        if (only > 0 && only != setup.decomposition.subdomains) continue;
        setup.decomposition.coupling = coupling;
        setup.decomposition.exchange = exchange;
        const Measured m = measure(setup, sample, steps, ranks);
        const bool in_paper = !(central && coupling == Coupling::schwarz);
        say(fmt::format(
            "| {} | {} | {} | {} | {:.1f} | {} | {:.1f} | {:.1f} % | {} | {:.2f} % | {:.2f} % | {} | {} |\n",
            setup.decomposition.subdomains, couplings().of(coupling).name, central ? "CCS" : "DCS",
            m.messages.messages, static_cast<double>(m.messages.bytes) / 1e3, m.messages.between_ranks,
            static_cast<double>(m.messages.bytes_between_ranks) / 1e3, 100 * m.waited,
            in_paper ? fmt::format("{:g} %", central ? row.paper_ccs : row.paper_dcs) : "", 100 * m.dealing,
            100 * m.detection, m.broad_phases, m.migrants));
      }
}
