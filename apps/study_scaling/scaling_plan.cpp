#include "apps/study_scaling/scaling_plan.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "apps/shared/child_process.hpp"
#include "apps/shared/trace_feed.hpp"
#include "io/scene/scene_error.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

/// Ascending, without repeats.
std::vector<int> ascending(const std::vector<int>& given) {
  const std::set<int> sorted(given.begin(), given.end());
  return {sorted.begin(), sorted.end()};
}

void refuse(const std::string& what) {
  throw std::invalid_argument(what);
}

ScalingNetwork given_network(const StudyScalingOptions& options) {
  ScalingNetwork network = scaling_network("today");
  network.name = "given";
  network.machine.latency = options.latency.value_or(network.machine.latency);
  network.machine.bandwidth = options.bandwidth.value_or(network.machine.bandwidth);
  network.machine.overhead = options.overhead.value_or(network.machine.overhead);
  network.machine.ranks_per_node = options.ranks_per_node.value_or(network.machine.ranks_per_node);
  network.description = fmt::format("{:g} s, {:g} B/s a node of {} ranks, {:g} s a message for the core",
                                    network.machine.latency, network.machine.bandwidth,
                                    network.machine.ranks_per_node, network.machine.overhead);
  return network;
}

}  // namespace

std::vector<OtherSpeedup> read_speedups(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw io::SceneError(path, 0, "", "cannot open the table of speedups");
  std::vector<OtherSpeedup> all;
  int number = 0;
  bool header = false;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty() || line.front() == '#') continue;
    if (!header) {
      if (line != "name,cores,speedup")
        throw io::SceneError(path, number, "", "the first line must be name,cores,speedup");
      header = true;
      continue;
    }
    const std::size_t last = line.rfind(','), first = last == std::string::npos || last == 0
                                                          ? std::string::npos
                                                          : line.rfind(',', last - 1);
    try {
      if (first == std::string::npos) throw std::invalid_argument(line);
      const OtherSpeedup other{line.substr(0, first), std::stod(line.substr(first + 1, last - first - 1)),
                               std::stod(line.substr(last + 1))};
      if (!(other.cores > 0) || !(other.speedup > 0)) throw std::invalid_argument(line);
      all.push_back(other);
    } catch (const std::logic_error&) {
      throw io::SceneError(path, number, "", fmt::format("'{}' is not name,cores,speedup", line));
    }
  }
  return all;
}

std::vector<int> cores_to_measure(int cores) {
  std::vector<int> all;
  for (int count = 1; count < cores; count *= 2) all.push_back(count);
  all.push_back(cores);
  return all;
}

ScalingPlan plan_of(const StudyScalingOptions& options) {
  ScalingPlan plan;
  const auto [first, last] = parse_steps(options.steps, "--steps");
  if (last == trace::largest_step) refuse(fmt::format("--steps {}: say which is the last", options.steps));
  plan.first = first;
  plan.last = last;
  std::vector<int> strong = options.subdomains;
  if (strong.empty()) strong = {1, 2, 4, 8, 16};
  strong.push_back(1);  // what the others are held against
  plan.cores = options.cores.value_or(omp_get_num_procs());
  plan.repeat = options.repeat;
  if (plan.repeat > 0)
    for (const int cores : cores_to_measure(plan.cores)) strong.push_back(cores);
  plan.strong = ascending(strong);
  if (!options.no_weak) {
    std::vector<int> weak = options.weak.empty() ? plan.strong : options.weak;
    weak.push_back(1);
    plan.weak = ascending(weak);
  }
  plan.hybrid = options.hybrid.empty() ? std::vector<int>{plan.strong.back()} : ascending(options.hybrid);
  for (const int n : plan.hybrid)
    if (!std::ranges::binary_search(plan.strong, n))
      refuse(
          fmt::format("--hybrid {}: there will be no trace of {} subdomains; add it to --subdomains", n, n));
  for (const std::string& name : options.networks) plan.networks.push_back(scaling_network(name));
  if (options.latency || options.bandwidth || options.overhead || options.ranks_per_node)
    plan.networks.push_back(given_network(options));
  if (plan.networks.empty()) plan.networks.push_back(scaling_network("today"));
  for (const std::string& variant : options.variants) {
    if (split_words(variant).empty()) refuse("--variant names no override");
    for (const std::string& word : split_words(variant))
      if (word.starts_with("decomposition.subdomains") || word.starts_with("decomposition.boxes"))
        refuse(fmt::format("--variant {}: the study chooses the subdomains itself; see --subdomains", word));
    plan.variants.push_back(variant);
  }
  if (!options.beside.empty()) plan.beside = read_speedups(options.beside);
  plan.record = options.record;
  plan.typical = options.typical;
  plan.own_caches = options.own_caches;
  plan.quantile = options.quantile;
  const std::string mpirun = options.mpirun.empty() ? "mpirun" : split_words(options.mpirun).front();
  if (plan.repeat > 0 && plan.cores > 1 && !program_exists(mpirun))
    refuse(
        fmt::format("{} is not to be found; real runs on several ranks need it. Load MPI, name it with "
                    "--mpirun, or ask for --cores 1",
                    mpirun));
  if (!options.smpi.empty()) {
    if (!fs::is_regular_file(options.smpi))
      refuse(options.smpi + " is not there: --smpi wants the talus of preset smpi");
    if (!program_exists(options.smpirun)) refuse(options.smpirun + " is not to be found; see --smpirun");
  }
  return plan;
}

}  // namespace talus
