/// Iterations to an error, time per iteration and messages by the number of subdomains and the coupling, on a
/// packing of spheres that begins cold: one step, first frictional between three fixed and three pressed
/// walls, then under gravity.
///
///   bench_coupling SPHERES.csv [PARTITIONER]
///
/// SPHERES.csv: a first line `# L` with the edge of the box [0, L]^3, a header, then x,y,z,r per line. The
/// time is that of one thread for an iteration, its ratio to the row without subdomains is the cost of
/// over-decomposition.

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

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
  setup.solver.balance_tolerance = 1e9;  // sweeps to an error are what other codes report
  setup.solver.max_iterations = 6000;
  setup.solver.check_every = 5;
  return setup;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "bench_coupling SPHERES.csv [PARTITIONER]\n");
    return 2;
  }
  const Packing packing = read_packing(argv[1]);
  const PartitionKind kind = argc > 2 ? partition_kind(argv[2]) : PartitionKind::boxes;
  struct Row {
    int subdomains, sweeps_per_exchange;
    Coupling coupling;
    ExchangeScheme exchange;
  };
  const std::vector<Row> rows = {
      {1, 1, Coupling::nscdd, ExchangeScheme::dcs},   {2, 1, Coupling::nscdd, ExchangeScheme::dcs},
      {12, 1, Coupling::nscdd, ExchangeScheme::dcs},  {96, 1, Coupling::nscdd, ExchangeScheme::dcs},
      {2, 5, Coupling::nscdd, ExchangeScheme::dcs},   {12, 5, Coupling::nscdd, ExchangeScheme::dcs},
      {96, 5, Coupling::nscdd, ExchangeScheme::dcs},  {12, 1, Coupling::nscdd, ExchangeScheme::ccs},
      {2, 1, Coupling::schwarz, ExchangeScheme::dcs}, {12, 1, Coupling::schwarz, ExchangeScheme::dcs},
      {96, 1, Coupling::schwarz, ExchangeScheme::dcs}};
  for (const bool pile : {false, true}) {
    const double tolerance = pile ? 1e-4 : 1e-3;
    fmt::print("\n{}, error {:g}, {} grains, {}\n", pile ? "pile" : "triaxial", tolerance,
               packing.bodies.size(), name_of(kind));
    fmt::print(
        "| subdomains | n_GS | coupling | exchange | sweeps | error | us per sweep | messages | kB per "
        "exchange |\n");
    fmt::print("| ---: | ---: | --- | --- | ---: | ---: | ---: | ---: | ---: |\n");
    for (const Row& row : rows) {
      Setup setup = scene(packing, pile, tolerance);
      setup.decomposition.subdomains = row.subdomains;
      setup.decomposition.partitioner = kind;
      setup.decomposition.coupling = row.coupling;
      setup.decomposition.exchange = row.exchange;
      setup.decomposition.sweeps_per_exchange = row.sweeps_per_exchange;
      graph::Executor executor({.threads = 1});
      Simulation simulation(setup, packing.bodies, executor);
      const StepReport& report = simulation.step();
      const MessageCount& messages = simulation.messages();
      fmt::print("| {} | {} | {} | {} | {}{} | {:.1e} | {:.0f} | {} | {:.1f} |\n", row.subdomains,
                 row.sweeps_per_exchange, row.coupling == Coupling::nscdd ? "NSCDD" : "Schwarz",
                 row.exchange == ExchangeScheme::dcs ? "DCS" : "CCS", report.iterations,
                 report.converged ? "" : " (missed)", report.error_rms,
                 1e6 * simulation.sums().times.iteration / report.iterations, messages.messages,
                 static_cast<double>(messages.bytes) / 1e3);
      std::fflush(stdout);
    }
  }
}
