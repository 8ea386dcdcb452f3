/// What a task costs beyond its work, for the ways to run coloured chunks: the epoch loop, OpenMP tasks, and
/// a barrier per colour. The graph is that of a grid of chunks, each in conflict with its 26 neighbours, in 8
/// colours by parity; threads own slabs.
///
///     bench_task_cost [repeats, default 51]
///
/// Times are medians over the repeats, methods taken in turn so that a disturbance of the machine meets all
/// of them, and the best beside, because another process on a core stretches medians of methods that wait.
/// Every run checks that each chunk was run once per epoch, in an order that conflicts allow.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/graph/epoch_loop.hpp"
#include "runtime/graph/executor.hpp"

namespace {

using talus::graph::Conflicts;
using talus::graph::EpochGraph;
using talus::graph::Executor;
using talus::graph::Graph;
using talus::graph::Handles;
using talus::graph::Worker;

/// n x n x n chunks, x fastest, so that ranges of indices are slabs.
struct Grid {
  std::vector<std::uint32_t> colour, offset{0}, neighbour;
  std::vector<std::vector<std::uint32_t>> by_colour;
  Conflicts view() const { return {colour, offset, neighbour}; }
};

Grid make_grid(int n) {
  Grid grid;
  grid.by_colour.resize(8);
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const auto parity = static_cast<std::uint32_t>(x % 2 + 2 * (y % 2) + 4 * (z % 2));
        grid.by_colour[parity].push_back(static_cast<std::uint32_t>(grid.colour.size()));
        grid.colour.push_back(parity);
        for (int k = std::max(0, z - 1); k <= std::min(n - 1, z + 1); ++k)
          for (int j = std::max(0, y - 1); j <= std::min(n - 1, y + 1); ++j)
            for (int i = std::max(0, x - 1); i <= std::min(n - 1, x + 1); ++i)
              if (i != x || j != y || k != z)
                grid.neighbour.push_back(static_cast<std::uint32_t>((k * n + j) * n + i));
        grid.offset.push_back(static_cast<std::uint32_t>(grid.neighbour.size()));
      }
  return grid;
}

/// A chunk's data: on a line of its own, as the bodies of real chunks are.
struct alignas(64) Chunk {
  std::uint64_t state = 1;
  int epochs = 0;
};

/// `links` dependent multiplications, about 1 ns each; the clock is not asked, so that a stolen core shows.
void work(Chunk& chunk, int links) {
  std::uint64_t state = chunk.state;
  for (int i = 0; i < links; ++i) state = state * 6364136223846793005ULL + 1442695040888963407ULL;
  chunk.state = state;
  ++chunk.epochs;
}

struct Sweep {
  std::vector<Chunk>& chunks;
  int links;
  int epochs;
  int gate_every;
  void node(std::uint32_t node, int) const { work(chunks[node], links); }
  bool gate(int epoch) const { return (epoch + 1) % gate_every == 0 || epoch + 1 == epochs; }
  bool decide(int epoch) const { return epoch + 1 < epochs; }
};

struct Case {
  const Grid& grid;
  int threads;
  int links;
  int epochs;
};

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// Runs all epochs and returns the seconds they took, from a moment when all threads were awake.
using Method = std::function<double(const Case&, std::vector<Chunk>&)>;

double plain_loop(const Case& c, std::vector<Chunk>& chunks) {
  const auto begin = Clock::now();
  for (int epoch = 0; epoch < c.epochs; ++epoch)
    for (const auto& nodes : c.grid.by_colour)
      for (const std::uint32_t node : nodes) work(chunks[node], c.links);
  return seconds_since(begin);
}

void plan(EpochGraph& loop, const Grid& grid, int threads) {
  std::vector<std::uint32_t> owner(grid.colour.size());
  talus::graph::assign_owners(std::vector<std::uint32_t>(owner.size(), 1), threads, owner);
  loop.build(grid.view(), owner, threads);
}

Method epoch_loop(int gate_every) {
  return [gate_every](const Case& c, std::vector<Chunk>& chunks) {
    EpochGraph loop;
    plan(loop, c.grid, c.threads);
    Sweep sweep{chunks, c.links, c.epochs, gate_every};
    std::atomic<int> awake = 0;
    double elapsed = 0;
    Graph graph;
    graph.team("sweep", {}, [&](Worker& me) {
      ++awake;
      me.wait([&] { return awake == me.threads(); });
      const auto begin = Clock::now();
      run_epochs(loop, me, sweep);
      if (me.thread() == 0) elapsed = seconds_since(begin);
    });
    Executor({.threads = c.threads}).run(graph);
    return elapsed;
  };
}

double barrier_per_colour(const Case& c, std::vector<Chunk>& chunks) {
  double elapsed = 0;
#pragma omp parallel num_threads(c.threads)
  {
#pragma omp barrier
    const auto begin = Clock::now();
    for (int epoch = 0; epoch < c.epochs; ++epoch)
      for (const auto& nodes : c.grid.by_colour) {
#pragma omp for schedule(static)
        for (std::size_t i = 0; i < nodes.size(); ++i) work(chunks[nodes[i]], c.links);
      }
#pragma omp master
    elapsed = seconds_since(begin);
  }
  return elapsed;
}

/// One dependence per task, on its own last run, and a taskwait per colour: the cheapest correct use of
/// tasks.
double tasks_by_colour(const Case& c, std::vector<Chunk>& chunks) {
  Chunk* const data = chunks.data();
  double elapsed = 0;
#pragma omp parallel num_threads(c.threads)
  {
#pragma omp barrier
#pragma omp single
    {
      const auto begin = Clock::now();
      for (int epoch = 0; epoch < c.epochs; ++epoch)
        for (const auto& nodes : c.grid.by_colour) {
          for (const std::uint32_t node : nodes) {
#pragma omp task firstprivate(node) depend(inout : data[node])
            work(data[node], c.links);
          }
#pragma omp taskwait
        }
      elapsed = seconds_since(begin);
    }
  }
  return elapsed;
}

/// Within an epoch the order of the epoch loop, a barrier between epochs: libgomp's lists of readers grow
/// without bound otherwise.
double tasks_after_neighbours(const Case& c, std::vector<Chunk>& chunks) {
  Chunk* const data = chunks.data();
  const std::uint32_t* const neighbour = c.grid.neighbour.data();
  double elapsed = 0;
#pragma omp parallel num_threads(c.threads)
  {
#pragma omp barrier
#pragma omp single
    {
      const auto begin = Clock::now();
      for (int epoch = 0; epoch < c.epochs; ++epoch) {
        for (const auto& nodes : c.grid.by_colour)
          for (const std::uint32_t node : nodes) {
            const std::uint32_t first = c.grid.offset[node], last = c.grid.offset[node + 1];
#pragma omp task firstprivate(node) depend(inout                                   \
                                           : data[node]) depend(iterator(i = first \
                                                                         : last),  \
                                                                in                 \
                                                                : data[neighbour[i]])
            work(data[node], c.links);
          }
#pragma omp taskwait
      }
      elapsed = seconds_since(begin);
    }
  }
  return elapsed;
}

double seconds(const Method& method, const Case& c, std::uint64_t expected) {
  std::vector<Chunk> chunks(c.grid.colour.size());
  const double elapsed = method(c, chunks);
  for (const Chunk& chunk : chunks)
    if (chunk.epochs != c.epochs || chunk.state != expected)
      throw std::runtime_error("a chunk was not run once per epoch");
  return elapsed;
}

struct Row {
  std::string name;
  Method method;
  std::vector<double> times;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

double best(const std::vector<double>& values) {
  return *std::min_element(values.begin(), values.end());
}

/// What a task costs beyond its work: the time of all threads per task, less that of the plain loop when
/// there is work. Efficiency: time of the plain loop over the time of all threads.
void print_table(const Grid& grid, int links, int epochs, int repeats) {
  std::vector<Chunk> once(1);
  for (int i = 0; i < epochs; ++i) work(once[0], links);
  const std::uint64_t expected = once[0].state;
  const auto tasks = static_cast<double>(grid.colour.size()) * epochs;
  Row plain{"plain loop", plain_loop, {}};
  for (const int threads : {1, 2}) {
    std::vector<Row> rows;
    rows.push_back({"epoch loop, one decision", epoch_loop(epochs), {}});
    rows.push_back({"epoch loop, decision every 10", epoch_loop(10), {}});
    rows.push_back({"omp for, barrier per colour", barrier_per_colour, {}});
    rows.push_back({"omp task, taskwait per colour", tasks_by_colour, {}});
    rows.push_back({"omp task, depend on neighbours", tasks_after_neighbours, {}});
    const Case c{grid, threads, links, epochs};
    for (int repeat = 0; repeat <= repeats; ++repeat) {
      plain.times.push_back(seconds(plain.method, c, expected));
      for (Row& row : rows) row.times.push_back(seconds(row.method, c, expected));
    }
    if (threads == 1) rows.insert(rows.begin(), plain);
    for (const Row& row : rows) {
      const auto cost = [&](double elapsed, double alone) {
        return (threads * elapsed - (links > 0 ? alone : 0)) / tasks * 1e9;
      };
      const double alone = median(plain.times), alone_best = best(plain.times);
      const double mid = median(row.times), low = best(row.times);
      fmt::print("| {:6} | {:7} | {:30} | {:9.1f} | {:9.1f} | {:10.2f} | {:10.2f} |\n", grid.colour.size(),
                 threads, row.name, cost(mid, alone), cost(low, alone_best), alone / (threads * mid),
                 alone_best / (threads * low));
    }
  }
}

void print_plan(const Grid& grid, int threads, int repeats) {
  EpochGraph loop;
  std::vector<double> times;
  for (int repeat = 0; repeat <= repeats; ++repeat) {
    const auto begin = Clock::now();
    plan(loop, grid, threads);
    times.push_back(seconds_since(begin));
  }
  fmt::print("plan of {} chunks, {} conflicts, {} threads: {:.1f} us, {} waits per epoch, {} bytes\n",
             grid.colour.size(), grid.neighbour.size() / 2, threads, median(times) * 1e6, loop.wait_count(),
             loop.memory_used());
}

/// Plain tasks of the executor: rebuilt and run, each with two accesses.
void print_executor(int repeats) {
  constexpr std::uint32_t parts = 1000;
  for (const int threads : {1, 2}) {
    Executor executor({.threads = threads});
    Graph graph;
    std::vector<double> times;
    for (int repeat = 0; repeat <= repeats; ++repeat) {
      const auto begin = Clock::now();
      graph.clear();
      const auto source = graph.data("source");
      const Handles part = graph.data("part", parts);
      graph.task("source", {talus::graph::write(source)}, [] {});
      for (std::uint32_t i = 0; i < parts; ++i)
        graph.task("part", {talus::graph::read(source), talus::graph::write(part[i])}, [] {});
      executor.run(graph);
      times.push_back(seconds_since(begin));
    }
    fmt::print("graph of {} coarse tasks, rebuilt and run, {} threads: {:.0f} ns per task\n", parts + 1,
               threads, median(times) / (parts + 1) * 1e9);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int repeats = argc > 1 ? std::max(1, std::atoi(argv[1])) : 51;
  // Runs of about a millisecond: shorter than a slice of the operating system, so that many of them see no
  // other process.
  for (const int links : {0, 3000}) {
    fmt::print("\n{}; {} repeats\n", links == 0 ? "Empty chunks" : "Chunks of about 3 us", repeats);
    fmt::print(
        "| chunks | threads | method                         | ns / task | best      | efficiency | best     "
        "  |\n");
    fmt::print(
        "| -----: | ------: | ------------------------------ | --------: | --------: | ---------: | "
        "---------: |\n");
    for (const int n : {4, 6, 8}) print_table(make_grid(n), links, links == 0 ? 100 : 20, repeats);
  }
  fmt::print("\n");
  for (const int threads : {1, 2, 8}) print_plan(make_grid(6), threads, repeats);
  print_executor(repeats);
}
