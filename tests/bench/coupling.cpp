/// Sweeps to an error, and messages, by the number of subdomains and the coupling: one step of a packing of
/// spheres that begins cold.
///
///   bench_coupling SPHERES.csv [PARTITIONER]
///   bench_coupling SCENE.toml RESULTS.h5 [PARTITIONER]
///
/// SPHERES.csv: a first line `# L` with the edge of the box [0, L]^3, a header, then x,y,z,r per line; first
/// frictional between three fixed and three pressed walls, then under gravity. SCENE and RESULTS: the last
/// frame of a run, with the walls' loads of the scene and gravity, friction and time step of its last stage.
///
/// Sweeps are counted to the first of checks 10 sweeps apart that is passed, found by bisection between the
/// two checks of a run that enclose it. The last column is the time of one thread for a sweep.

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/results/results.hpp"
#include "io/scene/scene.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/bench/packed_scene.hpp"

namespace {

using namespace talus;
using bench::packed_scene;
using bench::Packing;
using bench::read_packing;

/// The last frame of a run, its grains at their speed.
Bodies read_state(const std::string& path, io::Scene& scene) {
  const Frame frame = io::read_frame(path, io::frame_count(path) - 1);
  Bodies bodies;
  Sample sample;
  sample.x = frame.x;
  sample.radius = frame.radius;
  sample.density = scene.density;
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    add_sphere(bodies, BodyId{frame.id[k]}, frame.x[k], frame.radius[k], scene.density);
    Velocity& v = bodies.velocity.back();
    std::copy_n(frame.u[k].data(), 3, v.u);
    for (std::size_t axis = 0; axis < 3 && !frame.omega.empty(); ++axis)
      v.w[axis] = frame.radius[k] * frame.omega[k][static_cast<Eigen::Index>(axis)];
  }
  io::place_walls(scene, sample);
  for (Wall& wall : scene.setup.walls)
    for (const WallReport& then : frame.walls)
      if (then.name == wall.name) wall.point += (then.position - wall.normal.dot(wall.point)) * wall.normal;
  Stage stage = scene.setup.stages.back();
  stage.loads.clear();
  stage.end = {};
  stage.end.steps = 1;
  scene.setup.stages = {stage};
  return bodies;
}

struct Count {
  int sweeps = 0;
  bool reached = false;
  double error = 0, seconds = 0;
  MessageCount messages;
  std::vector<ErrorCheck> history;
};

Count solve(Setup setup, const Bodies& bodies, int max_iterations) {
  setup.solver.method = SolverMethod::nlgs;
  setup.solver.max_iterations = max_iterations;
  setup.solver.balance_tolerance = 1e9;  // sweeps to an error are what other codes report
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, bodies, executor);
  const StepReport& report = simulation.step();
  return {report.iterations,     report.error_rms <= setup.solver.tolerance,
          report.error_rms,      simulation.sums().times.iteration,
          simulation.messages(), simulation.error_history()};
}

/// The first of checks 10 sweeps apart that is passed.
Count sweeps_to_tolerance(const Setup& setup, const Bodies& bodies) {
  Count best = solve(setup, bodies, 8000);
  if (!best.reached || best.history.size() < 2) return best;
  int missed = best.history[best.history.size() - 2].iterations;
  while (best.sweeps - missed > 10) {
    const int middle = (missed + best.sweeps) / 20 * 10;
    if (middle <= missed) break;
    Count count = solve(setup, bodies, middle);
    if (count.reached)
      best = std::move(count);
    else
      missed = middle;
  }
  return best;
}

void print_table(const Setup& given, const Bodies& bodies, PartitionKind kind) {
  struct Row {
    int subdomains, sweeps_per_exchange;
    Coupling coupling;
    ExchangeScheme exchange;
  };
  std::vector<Row> rows = {{1, 1, Coupling::nscdd, ExchangeScheme::dcs}};
  for (const int sweeps_per_exchange : {1, 5})
    for (const int subdomains : {2, 12, 96})
      rows.push_back({subdomains, sweeps_per_exchange, Coupling::nscdd, ExchangeScheme::dcs});
  rows.push_back({12, 1, Coupling::nscdd, ExchangeScheme::ccs});
  for (const Coupling coupling : {Coupling::alternating, Coupling::schwarz})
    for (const int subdomains : {2, 12, 96}) rows.push_back({subdomains, 1, coupling, ExchangeScheme::dcs});
  fmt::print("\n{}, error {:g}, {} grains, {}\n", given.stages[0].name, given.solver.tolerance, bodies.size(),
             name_of(kind));
  fmt::print(
      "| subdomains | n_GS | coupling | exchange | sweeps | error | messages | kB per exchange | us per "
      "sweep "
      "|\n| ---: | ---: | --- | --- | ---: | ---: | ---: | ---: | ---: |\n");
  for (const Row& row : rows) {
    Setup setup = given;
    setup.decomposition.subdomains = row.subdomains;
    setup.decomposition.partitioner = kind;
    setup.decomposition.coupling = row.coupling;
    setup.decomposition.exchange = row.exchange;
    setup.decomposition.sweeps_per_exchange = row.sweeps_per_exchange;
    const Count count = sweeps_to_tolerance(setup, bodies);
    fmt::print("| {} | {} | {} | {} | {}{} | {:.1e} | {} | {:.1f} | {:.0f} |\n", row.subdomains,
               row.sweeps_per_exchange, couplings().of(row.coupling).name,
               row.exchange == ExchangeScheme::dcs ? "DCS" : "CCS", count.sweeps,
               count.reached ? "" : " (missed)", count.error, count.messages.messages,
               static_cast<double>(count.messages.bytes) / 1e3,
               1e6 * count.seconds / std::max(count.sweeps, 1));
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string first = argc > 1 ? argv[1] : "";
  const bool state = first.ends_with(".toml");
  if (argc < 2 + state) {
    fmt::print(
        stderr,
        "bench_coupling SPHERES.csv [PARTITIONER]\nbench_coupling SCENE.toml RESULTS.h5 [PARTITIONER]\n");
    return 2;
  }
  const PartitionKind kind = argc > 2 + state ? partition_kind(argv[2 + state]) : PartitionKind::boxes;
  if (state) {
    io::Scene scene = io::load_scene(first);
    const Bodies bodies = read_state(argv[2], scene);
    for (const double tolerance : {1e-3, 1e-4}) {
      // The floor of the pressed box at this friction is near 1e-4: see docs/performance.md.
      if (tolerance < 1e-3 && scene.setup.stages[0].gravity.isZero()) continue;
      scene.setup.solver.tolerance = tolerance;
      print_table(scene.setup, bodies, kind);
    }
    return 0;
  }
  const Packing packing = read_packing(first);
  for (const bool pile : {false, true})
    print_table(packed_scene(packing, pile, pile ? 1e-4 : 1e-3), packing.bodies, kind);
}
