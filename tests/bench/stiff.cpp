/// Error of forces and velocities against time on stiff scenes: ADMM in body space beside plain sweeps of the
/// same program.
///
///   bench_stiff [SPHERES.csv] [SWEEPS]
///
/// Columns have exact forces: the weight above. The heavy plate, 10^6 grain masses on a pile of 16,000
/// spheres, has to come to rest, and the force on it is its weight, where the pile has settled under it (two
/// minutes). Times are thread CPU seconds of one
/// thread, and the number of plain sweeps of the same contacts that fit into them (measured in the same
/// run). SPHERES.csv as for bench_sweep; SWEEPS of plain Gauss-Seidel to compare with, default 10000 on
/// columns and 1000 on the pile.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numeric>

#include "kernels/global/admm.hpp"
#include "kernels/samples/sample.hpp"
#include "kernels/sweeps/sweep.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/bench/clocks.hpp"
#include "tests/bench/packing.hpp"
#include "tests/unit/dense_sample.hpp"

namespace {

using namespace talus;
using bench::cpu_now;
using bench::Packing;

constexpr double gravity = 9.81, mu = 0.35;
const SweepKernels kernels(InstructionSet::automatic);

/// One step's problem and plain Gauss-Seidel on it.
struct Scene {
  test::Sample sample;
  FreeVelocity free;
  std::vector<WallMotion> walls;
  std::vector<WallCopy> copies;
  std::vector<std::vector<std::int32_t>> copies_of;  ///< per wall
  PairTable laws = laws_of_one_material(mu, mu, 0);
  double time_step = 1e-3;

  void prepare(double alert, bool closed) {
    sample.candidates = test::find_candidates(sample.bodies, sample.walls, alert, true);
    sample.chunks = cut_chunks(sample.candidates, sample.bodies.size(), 384);
    allocate(sample.contacts, sample.candidates, sample.chunks, true);
    const NarrowPhase in{
        sample.bodies.x,     sample.bodies.radius, sample.bodies.velocity, sample.walls, time_step, alert, {},
        Vec3(0, 0, -gravity)};
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      narrow_chunk(in, sample.candidates, sample.chunks, c, best_instruction_set(), sample.contacts);
    if (closed) std::fill(sample.contacts.bias.begin(), sample.contacts.bias.end(), 0.0);
    free.u.resize(sample.bodies.size());
    free.w.resize(sample.bodies.size());
    free_velocities({0, sample.bodies.size()}, sample.bodies.velocity, time_step, Vec3(0, 0, -gravity), free);
    for (const Wall& wall : sample.walls)
      walls.push_back(
          {wall.normal, Vec3(time_step * wall.load.force * wall.inv_mass() * wall.normal), wall.inv_mass()});
    copies.assign(sample.chunks.size(), {});
    copies_of.resize(walls.size());
    for (std::size_t c = 0; c < sample.chunks.size(); ++c)
      if (const std::int32_t w = sample.chunks.wall[c]; w >= 0 && sample.contacts.count[c] > 0)
        copies_of[static_cast<std::size_t>(w)].push_back(static_cast<std::int32_t>(c));
    for (std::size_t w = 0; w < walls.size(); ++w)
      for (std::int32_t c : copies_of[w])
        copies[static_cast<std::size_t>(c)].inv_mass =
            static_cast<double>(copies_of[w].size()) * walls[w].inv_mass;
  }

  void refresh() {
    std::vector<Slot> all(sample.bodies.size());
    std::iota(all.begin(), all.end(), 0);
    reset_to_free(all, free, sample.bodies.velocity);
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
      const std::int32_t w = sample.chunks.wall[c];
      if (w < 0) {
        kernels.accumulate_grains<true>(sample.contacts, sample.range(c), sample.bodies.velocity);
      } else {
        std::copy_n(walls[static_cast<std::size_t>(w)].free_velocity.data(), 3, copies[c].velocity);
        kernels.accumulate_wall<true>(sample.contacts, sample.range(c), sample.bodies.velocity, copies[c]);
      }
    }
    glue();
  }
  void glue() {
    for (std::size_t w = 0; w < walls.size(); ++w)
      if (walls[w].inv_mass > 0) glue_copies(copies, copies_of[w]);
  }
  void sweep(int count) {
    for (int k = 0; k < count; ++k) {
      for (std::size_t c = 0; c < sample.chunks.size(); ++c)
        if (sample.chunks.wall[c] < 0)
          kernels.sweep_grains<true>(sample.contacts, sample.range(c), sample.bodies.velocity, mu);
        else
          kernels.sweep_wall<true>(sample.contacts, sample.range(c), sample.bodies.velocity, mu, copies[c]);
      glue();
    }
  }
  /// The copy of a chunk, with the mass of its whole wall.
  WallCopy of_whole(std::size_t chunk, std::size_t wall) const {
    WallCopy copy = copies[chunk];
    copy.inv_mass = walls[wall].inv_mass;
    return copy;
  }
  double residual() const {
    ErrorSums sums;
    for (std::size_t c = 0; c < sample.chunks.size(); ++c) {
      const std::int32_t w = sample.chunks.wall[c];
      sums.add(w < 0
                   ? kernels.error_grains<true>(sample.contacts, sample.range(c), sample.bodies.velocity, mu)
                   : kernels.error_wall<true>(sample.contacts, sample.range(c), sample.bodies.velocity, mu,
                                              of_whole(c, static_cast<std::size_t>(w))));
    }
    return std::sqrt(sums.residual2 / std::max(sums.impulse2, sums.velocity2));
  }
  BodyProblem problem() const {
    return gather_problem({sample.bodies.x,
                           sample.bodies.radius,
                           sample.bodies.velocity,
                           free,
                           walls,
                           sample.chunks,
                           sample.contacts,
                           laws,
                           {}});
  }
};

/// Radius 1 cm, density 2600, on a floor; the top one `top` times as heavy.
Scene column_scene(int grains, double top) {
  Scene scene;
  const std::vector<double> radii(static_cast<std::size_t>(grains), 0.01);
  const std::vector<Vec3> x = column(radii, Vec3::Zero());
  for (std::size_t k = 0; k < x.size(); ++k)
    add_sphere(scene.sample.bodies, BodyId{static_cast<std::int64_t>(k)}, x[k], radii[k],
               k + 1 == x.size() ? 2600 * top : 2600);
  Wall floor;
  floor.name = "floor";
  scene.sample.walls = {floor};
  scene.prepare(1e-3, false);
  return scene;
}

/// Largest error of a normal force over the largest exact one.
double column_error(const Scene& scene) {
  const test::Sample& s = scene.sample;
  double error = 0, most = 0;
  for (std::size_t c = 0; c < s.chunks.size(); ++c)
    for (std::size_t k = s.range(c).begin; k < s.range(c).end; ++k) {
      // Bodies stand in the order of height.
      const auto upper = static_cast<std::size_t>(std::max(s.contacts.first[k], s.contacts.second[k]));
      double weight = 0;
      for (std::size_t b = upper; b < s.bodies.size(); ++b) weight += s.bodies.mass(b);
      const double exact = weight * gravity * scene.time_step;
      const double sign = s.contacts.second[k] < 0 || s.contacts.first[k] > s.contacts.second[k] ? 1 : -1;
      error = std::max(error, std::abs(sign * s.contacts.rz[k] - exact));
      most = std::max(most, exact);
    }
  return error / most;
}

/// The pile in its box; the lid is a plate of `plate` mean grain masses with nothing but its weight on it.
Scene plate_scene(const Packing& packing, double plate, bool closed) {
  Scene scene;
  scene.time_step = 0.005;
  scene.sample.bodies = packing.bodies;
  reorder(scene.sample.bodies, morton_order(scene.sample.bodies));
  scene.sample.walls = test::box_of_walls(0, packing.edge);
  double mass = 0;
  for (std::size_t b = 0; b < packing.bodies.size(); ++b) mass += packing.bodies.mass(b);
  WallLoad& load = scene.sample.walls[5].load;
  load.drive = WallDrive::force;
  load.mass = plate * mass / static_cast<double>(packing.bodies.size());
  load.force = load.mass * gravity;
  scene.prepare(0.02, closed);
  return scene;
}

struct PlateError {
  double velocity, force;  ///< over free fall, and over the weight
};
PlateError plate_error(const Scene& scene) {
  const WallMotion& plate = scene.walls[5];
  const double free = plate.free_velocity.norm();
  if (scene.copies_of[5].empty()) return {1, 1};
  const WallCopy& copy = scene.copies[static_cast<std::size_t>(scene.copies_of[5].front())];
  const double now = Eigen::Map<const Vec3>(copy.velocity).norm();
  double force = 0;
  for (std::int32_t c : scene.copies_of[5]) {
    const ContactRange range = scene.sample.range(static_cast<std::size_t>(c));
    for (std::size_t k = range.begin; k < range.end; ++k) force -= scene.sample.contacts.rz[k];
  }
  return {now / free, std::abs(force * plate.inv_mass / free - 1)};
}

double sweep_time(Scene scene, int sweeps) {
  scene.refresh();
  std::vector<double> times;
  for (int k = 0; k < 5; ++k) {
    const double start = cpu_now();
    scene.sweep(sweeps);
    times.push_back((cpu_now() - start) / sweeps);
  }
  std::nth_element(times.begin(), times.begin() + 2, times.end());
  return times[2];
}

void row(const std::string& what, double seconds, double sweep, const BodyAdmmResult* result,
         const std::string& error) {
  fmt::print("  {:<34}{:>9.3f} s{:>9.0f} sweeps", what, seconds, seconds / sweep);
  if (result)
    fmt::print("  {:>4} it {:>5} cg  kappa {:.1e} defects {:.1e} {:.1e} {:.1e}", result->iterations,
               result->linear_iterations, result->stiffness, result->momentum_defect, result->contact_defect,
               result->balance_defect);
  fmt::print("  {}\n", error);
}

Setup plate_setup(const Packing& packing, double friction) {
  Setup setup;
  setup.walls = plate_scene(packing, 1e6, false).sample.walls;
  Stage stage;
  stage.name = "plate";
  stage.time_step = 0.005;
  stage.gravity = Vec3(0, 0, -gravity);
  stage.laws = laws_of_one_material(friction, friction, 0);
  stage.end.steps = 1;
  setup.stages = {stage};
  setup.detection.alert = 0.02;
  setup.solver.max_iterations = 2000;
  return setup;
}

/// The pile as the packing has it; neighbours overlap a little, so that nothing is free to fall.
SavedState cut_pile(const Packing& packing) {
  Bodies bodies = packing.bodies;
  for (double& radius : bodies.radius) radius *= 1.008;
  graph::Executor executor({.threads = 1});
  return Simulation(plate_setup(packing, mu), std::move(bodies), executor).save();
}

/// The pile pressed with the weight of the plate, without friction, by a lid of its own mass: with friction
/// it rests under the plate.
SavedState settled_pile(const Packing& packing) {
  Setup setup = plate_setup(packing, 0);
  setup.walls[5].load.mass *= static_cast<double>(packing.bodies.size()) / 1e6;
  setup.stages[0].end.steps = 2000;
  setup.solver.tolerance = 1e-5;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, packing.bodies, executor);
  while (!simulation.finished()) {
    simulation.step();
    simulation.begin_next_stage();
  }
  fmt::print("pile of 16k pressed for {} steps, equilibrium {:.1e}\n", simulation.report().step,
             simulation.report().equilibrium);
  return simulation.save();
}

/// One step of the whole program with the plate on a pile, begun cold; ADMM by itself where it is needed.
void run_plate(const std::string& what, const Packing& packing, SavedState pile, int subdomains) {
  Setup setup = plate_setup(packing, mu);
  setup.solver.warm_start = false;
  setup.decomposition.subdomains = subdomains;
  pile.walls[5].load = setup.walls[5].load;
  pile.walls[5].velocity.setZero();
  pile.report = {};
  pile.stage_index = 0;
  pile.steps_of_stage = 0;
  graph::Executor executor({.threads = 1});
  Simulation simulation(setup, pile, executor);
  const double start = cpu_now();
  const StepReport& report = simulation.step();
  const double seconds = cpu_now() - start;
  const IterationResult& r = simulation.iterations();
  const WallReport plate = simulation.walls()[5];
  fmt::print(
      "plate of 1e6 on the {}, {:>2} subdomains: {:>5} sweeps, map {:.1e}, unbalance {:.1e}, admm {} x "
      "({} it, {} cg), {:.2f} s{}, velocity {:.2e} of g h, force {:.4f} of the weight\n",
      what, subdomains, report.iterations, r.error_rms, r.unbalance, r.stiff_calls, r.stiff.iterations,
      r.stiff.linear_iterations, seconds, report.converged ? "" : " MISSED",
      plate.velocity / (setup.stages[0].time_step * gravity), plate.force.norm() / setup.walls[5].load.force);
}

/// One step of the whole program with a column, cut in slices.
void run_column(int grains, double top, int subdomains, const SolverSettings& solver) {
  const Scene scene = column_scene(grains, top);
  Setup setup;
  setup.walls = scene.sample.walls;
  Stage stage;
  stage.name = "column";
  stage.time_step = scene.time_step;
  stage.gravity = Vec3(0, 0, -gravity);
  stage.laws = laws_of_one_material(mu, mu, 0);
  stage.end.steps = 1;
  setup.stages = {stage};
  setup.solver = solver;
  setup.decomposition.subdomains = subdomains;
  graph::Executor executor({.threads = 1});
  Bodies bodies = scene.sample.bodies;
  const std::vector<double> mass = [&] {
    std::vector<double> each;
    for (std::size_t b = 0; b < bodies.size(); ++b) each.push_back(bodies.mass(b));
    return each;
  }();
  Simulation simulation(setup, std::move(bodies), executor);
  const double start = cpu_now();
  const StepReport& report = simulation.step();
  const double seconds = cpu_now() - start;
  const IterationResult& r = simulation.iterations();
  const Frame frame = simulation.frame();
  double error = 0;
  for (std::size_t k = 0; k < frame.contact_force.size(); ++k) {
    // Ids count from the bottom; a wall's are negative.
    const auto [one, other] = frame.contact_bodies[k];
    double weight = 0;
    for (std::size_t b = static_cast<std::size_t>(std::max(one, other)); b < mass.size(); ++b)
      weight += gravity * mass[b];
    error = std::max(error, std::abs(std::abs(frame.contact_force[k][2]) - weight));
  }
  const double due = gravity * std::accumulate(mass.begin(), mass.end(), 0.0);
  fmt::print(
      "column of {}, top {:g}, one step to {:.0e}, {:>2} subdomains: {:>5} sweeps, unbalance {:.1e}, admm {} "
      "x "
      "({} it, {} cg), {:.3f} s{}, force error {:.1e}\n",
      grains, top, solver.tolerance, subdomains, report.iterations, r.unbalance, r.stiff_calls,
      r.stiff.iterations, r.stiff.linear_iterations, seconds, report.converged ? "" : " MISSED", error / due);
}

void compare(const std::string& name, const Scene& scene, int sweeps,
             std::span<const BodyAdmmSettings> settings,
             const std::function<std::string(const Scene&)>& error) {
  const BodyProblem cold = scene.problem();
  const double sweep = sweep_time(scene, std::max(1, sweeps / 100));
  fmt::print("{}: {} bodies, {} contacts, sweep {:.1f} us, estimated kappa {:.2g}\n", name,
             cold.bodies.size(), cold.contacts.size(), 1e6 * sweep, estimate_stiffness(cold));
  {
    Scene plain = scene;
    plain.refresh();
    const double start = cpu_now();
    plain.sweep(sweeps);
    const double seconds = cpu_now() - start;
    plain.refresh();
    row(fmt::format("nlgs, {} sweeps", sweeps), seconds, sweep, nullptr,
        fmt::format("{} map {:.1e}", error(plain), plain.residual()));
  }
  for (const BodyAdmmSettings& s : settings) {
    Scene stiff = scene;
    const double start = cpu_now();
    BodyProblem problem = stiff.problem();
    const BodyAdmmResult result = solve_admm(problem, s);
    scatter_impulses(problem, stiff.sample.contacts);
    stiff.refresh();
    stiff.sweep(10);
    const double seconds = cpu_now() - start;
    stiff.refresh();
    row(fmt::format("admm to {:.0e}, balance {:.0e}", s.tolerance, s.balance_tolerance), seconds, sweep,
        &result, fmt::format("{} map {:.1e}", error(stiff), stiff.residual()));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int sweeps = argc > 2 ? std::atoi(argv[2]) : 0;
  const auto force = [](const Scene& s) { return fmt::format("force error {:.1e}", column_error(s)); };
  std::vector<BodyAdmmSettings> chains;
  for (double tolerance : {1e-2, 1e-5}) {
    BodyAdmmSettings s;
    s.tolerance = tolerance;
    s.balance_tolerance = 0;
    chains.push_back(s);
  }
  for (const auto& [grains, top] : {std::pair{100, 1.0}, {1000, 1.0}, {100, 1e6}, {1000, 1e6}}) {
    const Scene scene = column_scene(grains, top);
    compare(fmt::format("column of {}, top {:g}", grains, top), scene, sweeps > 0 ? sweeps : 10000, chains,
            force);
  }
  SolverSettings by_default, strict;
  by_default.max_iterations = strict.max_iterations = 2000;
  strict.tolerance = 1e-8;
  strict.balance_tolerance = 1e-5;
  for (const SolverSettings& solver : {by_default, strict})
    for (const double top : {1.0, 1e6})
      for (const int subdomains : {1, 12, 96}) run_column(1000, top, subdomains, solver);
  if (argc < 2) return 0;
  const Packing packing = bench::read_packing(argv[1]);
  for (bool closed : {true, false}) {
    const Scene scene = plate_scene(packing, 1e6, closed);
    std::vector<BodyAdmmSettings> packings;
    for (double heavy : {5e-3, 2e-3, 1e-3}) {
      BodyAdmmSettings s;
      s.balance_tolerance = heavy;
      packings.push_back(s);
    }
    compare(closed ? "plate of 1e6 on 16k, touching" : "plate of 1e6 on 16k", scene,
            sweeps > 0 ? sweeps : 1000, packings, [](const Scene& s) {
              const PlateError e = plate_error(s);
              double v2 = 0;
              for (const Velocity& v : s.sample.bodies.velocity)
                v2 += v.u[0] * v.u[0] + v.u[1] * v.u[1] + v.u[2] * v.u[2];
              return fmt::format("velocity {:.2e} force {:.2e} rms {:.1e}", e.velocity, e.force,
                                 std::sqrt(v2 / 16000) / 0.005 / 9.81);
            });
  }
  const SavedState cut = cut_pile(packing), settled = settled_pile(packing);
  for (const int subdomains : {1, 12, 96}) run_plate("cut pile", packing, cut, subdomains);
  for (const int subdomains : {1, 12, 96}) run_plate("settled pile", packing, settled, subdomains);
}
