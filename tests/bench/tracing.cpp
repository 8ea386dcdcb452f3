/// What recording a trace costs a run: two simulations of one scene, one of which records, step by step in
/// turn.
///
///   bench_tracing SCENE.toml [THREADS, default 1] [STEPS, default 40] [SUBDOMAINS, default 8] [FRICTION]
///
/// Both make the same steps within a fraction of a second of each other, so that a busy machine slows both
/// down. A step that records ends when what it has handed over is in the file. Quartiles over the steps; 400
/// steps tell half a per cent.

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "apps/shared/sample_builder.hpp"
#include "apps/shared/trace_feed.hpp"
#include "io/scene/scene.hpp"
#include "runtime/graph/one_rank.hpp"
#include "runtime/step/dealing.hpp"
#include "runtime/step/simulation.hpp"
#include "tests/bench/clocks.hpp"

using namespace talus;
using bench::wall_now;

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "bench_tracing SCENE.toml [THREADS] [STEPS] [SUBDOMAINS] [FRICTION]\n");
    return 2;
  }
  const auto number = [&](int k, int otherwise) { return argc > k ? std::atoi(argv[k]) : otherwise; };
  const int threads = number(2, 1), steps = number(3, 40);
  io::Scene scene = io::load_scene(argv[1]);
  Sample sample = build_sample(scene);
  io::place_walls(scene, sample);
  scene.setup.decomposition.subdomains = number(4, 8);
  if (argc > 5)
    scene.setup.stages.front().laws.between(material_of_grains, material_of_grains).friction =
        std::atof(argv[5]);

  const std::filesystem::path directory = std::filesystem::temp_directory_path() / "talus_bench_tracing";
  std::filesystem::create_directories(directory);
  const graph::OneRank ranks;
  TraceFeed feed(directory.string(), {}, false, threads, ranks);
  graph::Executor plain({.threads = threads}), traced({.threads = threads, .trace = &feed.recorder()});
  feed.start(traced);
  const auto deal = [&] { return deal_out(sample, scene.setup.decomposition, ranks); };
  Simulation without(scene.setup, deal(), plain), with(scene.setup, deal(), traced, ranks);

  std::vector<double> ratio;
  for (int k = 0; k < steps && !without.finished(); ++k) {
    double took[2];
    for (const bool records : {k % 2 == 0, k % 2 != 0}) {
      const double start = wall_now();
      (records ? with : without).step();
      traced.drain();
      took[records] = wall_now() - start;
    }
    ratio.push_back(took[1] / took[0]);
    for (Simulation* simulation : {&with, &without}) simulation->begin_next_stage();
  }
  feed.finish(traced);
  const auto bytes = std::filesystem::file_size(io::trace_file_of(directory, 0));
  std::sort(ratio.begin(), ratio.end());
  const auto quartile = [&](std::size_t q) { return ratio[q * (ratio.size() - 1) / 4]; };
  fmt::print("{} steps, {} threads, {:.1f} MB: recording over not recording {:.3f} ({:.3f} - {:.3f})\n",
             ratio.size(), threads, 1e-6 * static_cast<double>(bytes), quartile(2), quartile(1), quartile(3));
  std::filesystem::remove_all(directory);
}
