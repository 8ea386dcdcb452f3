/// Times of the sweep, of detection and of cutting chunks on a dense packing of 16,000 spheres; bytes per
/// body and contact.
///
///   bench_sweep [SPHERES.csv] [REPEATS]
///
/// SPHERES.csv: a first line `# L` with the edge of the box [0, L]^3, a header, then x,y,z,r per line.
/// Without it a jittered hexagonal packing of 16,000 spheres is made. Each time is the median over the
/// repeats (default 9) of whole batches; the kernels stand beside one another in one run, so that ratios hold
/// on a busy machine.

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <stdexcept>

#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/narrow_phase.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/bench/packing.hpp"

namespace {

using namespace talus;

double clock_now(clockid_t clock) {
  timespec t;
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

using bench::make_packing;
using bench::Packing;
using bench::read_packing;

Setup pile(double edge, int sweeps, bool friction) {
  Setup setup;
  for (int axis = 0; axis < 3; ++axis)
    for (double side : {1.0, -1.0}) {
      Wall wall;
      wall.name = std::string(1, "xyz"[axis]) + (side > 0 ? "-" : "+");
      wall.normal = side * Vec3::Unit(axis);
      wall.point = side > 0 ? Vec3(Vec3::Zero()) : Vec3(edge * Vec3::Unit(axis));
      setup.walls.push_back(wall);
    }
  Stage stage;
  stage.name = "pile";
  stage.time_step = 0.005;
  stage.gravity = Vec3(0, 0, -9.81);
  if (friction) stage.laws = laws_of_one_material(0.35, 0.35, 0);
  stage.end.steps = 1000000;
  setup.stages = {stage};
  setup.detection.alert = 0.02;
  setup.solver.tolerance = 0;
  setup.solver.max_iterations = sweeps;
  setup.solver.check_every = sweeps;
  setup.solver.warm_start = false;
  setup.allow_unconverged = true;
  return setup;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

/// Thread CPU time of one call [s], which a busy machine stretches less than elapsed time.
double cpu_time(const std::function<void()>& work) {
  const double start = clock_now(CLOCK_THREAD_CPUTIME_ID);
  work();
  return clock_now(CLOCK_THREAD_CPUTIME_ID) - start;
}

struct Times {
  std::vector<double> sweep, measure, detection, cut, kept, anew;
  std::size_t contacts = 0;
};

template <bool Friction>
void sweep_once(const SweepKernels& kernels, const Chunks& chunks, Contacts& contacts,
                std::vector<Velocity>& velocity, std::vector<WallCopy>& copies) {
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const auto begin = static_cast<std::size_t>(chunks.begin[c]);
    const ContactRange range{begin, begin + static_cast<std::size_t>(contacts.count[c])};
    if (chunks.wall[c] < 0)
      kernels.sweep_grains<Friction>(contacts, range, velocity, 0.35);
    else
      kernels.sweep_wall<Friction>(contacts, range, velocity, 0.35, copies[c]);
  }
}

constexpr int sweeps_per_sample = 20;

/// The kernels by themselves, in the order of chunks, on copies of the state that a step left.
template <bool Friction>
void time_kernels(const StepState& state, Times& times, int repeats) {
  const SweepKernels kernels(best_instruction_set());
  Contacts contacts = state.contacts;
  std::vector<Velocity> velocity = state.bodies.velocity;
  std::vector<WallCopy> copies(state.chunks.size());
  for (std::int32_t count : contacts.count) times.contacts += static_cast<std::size_t>(count);
  std::vector<double> reach = state.reach_then;
  for (int repeat = 0; repeat <= repeats; ++repeat) {
    const double sweep = cpu_time([&] {
      for (int k = 0; k < sweeps_per_sample; ++k)
        sweep_once<Friction>(kernels, state.chunks, contacts, velocity, copies);
    });
    const double measure = cpu_time([&] {
      for (int k = 0; k < sweeps_per_sample; ++k)
        for (std::size_t c = 0; c < state.chunks.size(); ++c) {
          const auto begin = static_cast<std::size_t>(state.chunks.begin[c]);
          if (state.chunks.wall[c] < 0)
            kernels.error_grains<Friction>(
                contacts, {begin, begin + static_cast<std::size_t>(contacts.count[c])}, velocity, 0.35);
        }
    });
    std::vector<std::vector<GrainPair>> parts(1);
    const double detection = cpu_time([&] {
      const CellGrid grid = build_cells(state.bodies.x, reach);
      find_pairs(grid, 0, grid.cells.size(), parts[0]);
      sort_pairs(parts, reach.size());
    });
    const auto all = static_cast<std::int64_t>(state.candidates.size());
    const double cut =
        cpu_time([&] { cut_chunks(state.candidates, state.bodies.size(), chunk_target(all, all)); });
    const NarrowPhase in{
        state.bodies.x,   state.bodies.radius, state.bodies.velocity, state.walls, 0.005, 0.02, {},
        Vec3(0, 0, -9.81)};
    Contacts found = contacts;
    const auto narrow = [&] {
      for (std::size_t c = 0; c < state.chunks.size(); ++c)
        narrow_chunk(in, state.candidates, state.chunks, c, kernels.set(), found);
    };
    narrow();
    const double kept = cpu_time(narrow);
    found.count.assign(found.count.size(), 0);
    const double anew = cpu_time(narrow);
    if (repeat == 0) continue;  // warms up
    times.sweep.push_back(sweep / sweeps_per_sample);
    times.measure.push_back(measure / sweeps_per_sample);
    times.detection.push_back(detection);
    times.cut.push_back(cut);
    times.kept.push_back(kept);
    times.anew.push_back(anew);
  }
}

/// Elapsed time of one sweep inside whole steps [s], gates included: best and median. On a busy machine only
/// the best is near what two free cores would do.
struct LoopTime {
  double best, median;
};
LoopTime loop_time(const Packing& packing, int threads, int repeats, bool friction) {
  graph::Executor executor({.threads = threads});
  Simulation simulation(pile(packing.edge, 100, friction), packing.bodies, executor);
  std::vector<double> times;
  for (int repeat = 0; repeat <= repeats; ++repeat) {
    simulation.step();
    if (repeat > 0 && simulation.report().iterations > 0)
      times.push_back(simulation.sums().times.iteration / simulation.report().iterations);
  }
  if (times.empty()) throw std::runtime_error("no step needed a sweep: the packing touches nothing");
  return {*std::min_element(times.begin(), times.end()), median(times)};
}

template <bool Friction>
void report(const Packing& packing, int repeats) {
  graph::Executor executor({});
  Simulation simulation(pile(packing.edge, 100, Friction), packing.bodies, executor);
  simulation.step();
  const StepState& state = simulation.state();
  Times times;
  time_kernels<Friction>(state, times, repeats);
  const double sweep = median(times.sweep), contacts = static_cast<double>(times.contacts);
  const auto row = [&](const char* what, double seconds) {
    fmt::print("{:<34}{:>12.1f}{:>14.1f}{:>12.2f}\n", what, 1e6 * seconds, 1e9 * seconds / contacts,
               seconds / sweep);
  };
  fmt::print("\n{}: {} bodies, {} candidates, {} contacts, {} chunks in {} colours, {}, {} repeats\n",
             Friction ? "friction 0.35" : "frictionless", state.bodies.size(), state.candidates.size(),
             times.contacts, state.chunks.size(), state.chunks.colours, name_of(best_instruction_set()),
             repeats);
  fmt::print("{:<34}{:>12}{:>14}{:>12}\n", "kernel (thread CPU time, median)", "us", "ns/contact",
             "in sweeps");
  row("sweep, 1 thread", sweep);
  row("natural map (certificate)", median(times.measure));
  row("broad phase (cells, pairs, sort)", median(times.detection));
  row("cut_chunks", median(times.cut));
  row("narrow phase, groups kept", median(times.kept));
  row("narrow phase, all groups anew", median(times.anew));
  row("detection, all of it", median(times.detection) + median(times.cut) + median(times.anew));
  const LoopTime one = loop_time(packing, 1, repeats, Friction),
                 two = loop_time(packing, 2, repeats, Friction);
  fmt::print(
      "sweep inside steps, elapsed us, best (median): 1 thread {:.1f} ({:.1f}), 2 threads {:.1f} ({:.1f}), "
      "ratio {:.2f} ({:.2f})\n",
      1e6 * one.best, 1e6 * one.median, 1e6 * two.best, 1e6 * two.median, one.best / two.best,
      one.median / two.median);
  const auto bodies = static_cast<double>(state.bodies.size()),
             candidates = static_cast<double>(state.candidates.size());
  const double body_bytes =
      static_cast<double>(memory_used(state.bodies) +
                          (state.free.u.capacity() + state.free.w.capacity()) * 24 +
                          state.x_then.capacity() * 24 + state.reach_then.capacity() * 8) /
      bodies;
  const double contact_bytes =
      static_cast<double>(memory_used(state.contacts) + memory_used(state.candidates) +
                          memory_used(state.chunks)) /
      candidates;
  fmt::print(
      "memory: {:.0f} bytes per body, {:.0f} bytes per candidate; all arrays {:.1f} MB, 200,000 bodies alike "
      "{:.0f} MB\n",
      body_bytes, contact_bytes, 1e-6 * static_cast<double>(memory_used(state)),
      1e-6 * static_cast<double>(memory_used(state)) * 200000 / bodies);
}

}  // namespace

int main(int argc, char** argv) {
  const Packing packing = argc > 1 ? read_packing(argv[1]) : make_packing();
  const int repeats = argc > 2 ? std::max(5, std::atoi(argv[2])) : 9;
  report<true>(packing, repeats);
  report<false>(packing, repeats);
}
