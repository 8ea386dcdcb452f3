/// What building the contacts of a step costs, in plain sweeps over the same contacts: all that a step does
/// before its iterations (candidates, chunks, narrow phase, groups), over a whole run.
///
///   bench_building SCENE.toml [STEPS, default 200] [EVERY, default 50]
///
/// One thread. Behind every step ten plain sweeps run on copies of its contacts, so that both are measured at
/// the same time of a busy machine; each line is over EVERY steps: the median of the steps that kept their
/// candidates, of those that found them anew, and the mean of all by how many there were of each.

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "apps/shared/sample_builder.hpp"
#include "io/scene/scene.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/bench/clocks.hpp"

namespace {

using namespace talus;
using bench::cpu_now;

template <bool Friction>
double plain_sweep(const StepState& state) {
  const SweepKernels kernels(best_instruction_set());
  Contacts contacts = state.contacts;
  std::vector<Velocity> velocity = state.bodies.velocity;
  std::vector<WallCopy> copies(state.chunks.size());
  const auto sweep = [&] {
    for (std::size_t c = 0; c < state.chunks.size(); ++c) {
      const auto begin = static_cast<std::size_t>(state.chunks.begin[c]);
      const ContactRange range{begin, begin + static_cast<std::size_t>(contacts.count[c])};
      if (state.chunks.wall[c] < 0)
        kernels.sweep_grains<Friction>(contacts, range, velocity, 0.35);
      else
        kernels.sweep_wall<Friction>(contacts, range, velocity, 0.35, copies[c]);
    }
  };
  sweep();
  constexpr int sweeps = 10;
  const double start = cpu_now();
  for (int k = 0; k < sweeps; ++k) sweep();
  return (cpu_now() - start) / sweeps;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "bench_building SCENE.toml [STEPS] [EVERY]\n");
    return 2;
  }
  const int steps = argc > 2 ? std::atoi(argv[2]) : 200,
            every = argc > 3 ? std::max(1, std::atoi(argv[3])) : 50;
  io::Scene scene = io::load_scene(argv[1]);
  Sample sample = build_sample(scene);
  io::place_walls(scene, sample);
  graph::Executor executor({.threads = 1});
  Simulation simulation(scene.setup, deal_out(sample, scene.setup.decomposition, graph::one_rank()),
                        executor);
  fmt::print("{:>12} {:>6} {:>10} {:>14} {:>14} {:>12}\n", "stage", "step", "anew", "kept, sweeps",
             "anew, sweeps", "mean, sweeps");
  std::vector<double> kept, anew;
  for (int k = 1; k <= steps && !simulation.finished(); ++k) {
    simulation.step();
    const StepState& state = simulation.state();
    const double sweep = !state.contacts.rx.empty() ? plain_sweep<true>(state) : plain_sweep<false>(state);
    (simulation.sums().broad_phase ? anew : kept).push_back(simulation.sums().times.detection / sweep);
    if (k % every == 0) {
      const auto share = static_cast<double>(anew.size()) / static_cast<double>(anew.size() + kept.size());
      fmt::print("{:>12} {:>6} {:>9.0f}% {:>14.1f} {:>14.1f} {:>12.1f}\n", simulation.stage().name, k,
                 100 * share, median(kept), median(anew), share * median(anew) + (1 - share) * median(kept));
      kept.clear();
      anew.clear();
    }
    simulation.begin_next_stage();
  }
}
