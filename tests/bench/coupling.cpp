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
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/results.hpp"
#include "io/scene.hpp"
#include "runtime/step/simulation.hpp"

namespace {

using namespace talus;

struct Packing {
  double edge = 0;
  Bodies bodies;
};

Packing read_packing(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot open " + path);
  Packing packing;
  std::string line, word;
  std::getline(file, line);
  std::istringstream first(line);
  if (!(first >> word >> word >> packing.edge)) throw std::runtime_error(path + ":1: expected `# L <edge>`");
  std::getline(file, line);
  for (int number = 3; std::getline(file, line); ++number) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream values(line);
    double x, y, z, r;
    if (!(values >> x >> y >> z >> r))
      throw std::runtime_error(fmt::format("{}:{}: expected x,y,z,r", path, number));
    add_sphere(packing.bodies, BodyId{number - 3}, Vec3(x, y, z), r, 2600);
  }
  return packing;
}

Setup scene(const Packing& packing, bool pile, double tolerance) {
  Setup setup;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      Wall wall;
      wall.name = std::string(1, "xyz"[axis]) + (side > 0 ? "-" : "+");
      wall.normal = side * Vec3::Unit(axis);
      wall.point = Vec3::Unit(axis) * (side > 0 ? 0 : packing.edge);
      if (pile && wall.name == "z+") continue;
      setup.walls.push_back(wall);
    }
  double mass = 0;
  for (std::size_t k = 0; k < packing.bodies.size(); ++k) mass += packing.bodies.mass(k);
  Stage stage;
  stage.name = pile ? "pile" : "triaxial";
  stage.time_step = 1e-3;
  stage.law = {0.35, pile ? 0.35 : 0.0, 0};
  stage.end.steps = 1;
  if (pile) stage.gravity = Vec3(0, 0, -9.81);
  WallLoad load;
  load.drive = WallDrive::pressure;
  load.pressure = 9.81 * mass / (packing.edge * packing.edge);  // the weight of the sample on each face
  load.mass = 0.1 * mass;
  if (!pile)
    for (const char* name : {"x+", "y+", "z+"}) stage.loads.push_back({name, load});
  setup.stages = {stage};
  setup.solver.tolerance = tolerance;
  return setup;
}

/// The last frame of a run, its grains at their speed.
Bodies read_state(const std::string& path, io::Scene& scene) {
  const Frame frame = io::read_frame(path, io::frame_count(path) - 1);
  Bodies bodies;
  for (std::size_t k = 0; k < frame.id.size(); ++k) {
    add_sphere(bodies, BodyId{frame.id[k]}, frame.x[k], frame.radius[k], scene.density);
    Velocity& v = bodies.velocity.back();
    std::copy_n(frame.u[k].data(), 3, v.u);
    for (std::size_t axis = 0; axis < 3 && !frame.omega.empty(); ++axis)
      v.w[axis] = frame.radius[k] * frame.omega[k][static_cast<Eigen::Index>(axis)];
  }
  io::place_walls(scene, bodies);
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
  std::vector<Iteration::Check> history;
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
  for (const int subdomains : {2, 12, 96})
    rows.push_back({subdomains, 1, Coupling::schwarz, ExchangeScheme::dcs});
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
               row.sweeps_per_exchange, row.coupling == Coupling::nscdd ? "NSCDD" : "Schwarz",
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
    print_table(scene(packing, pile, pile ? 1e-4 : 1e-3), packing.bodies, kind);
}
