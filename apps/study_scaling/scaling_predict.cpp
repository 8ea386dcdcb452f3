#include "apps/study_scaling/scaling_predict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "io/trace/trace_file.hpp"
#include "runtime/trace/analysis.hpp"

namespace talus {

namespace {

trace::Machine network_machine(double latency, double bandwidth, double overhead, int ranks_per_node,
                               double node_latency, double node_bandwidth) {
  trace::Machine machine;
  machine.latency = latency;
  machine.bandwidth = bandwidth;
  machine.overhead = overhead;
  machine.ranks_per_node = ranks_per_node;
  machine.node_latency = node_latency;
  machine.node_bandwidth = node_bandwidth;
  return machine;
}

/// The critical path by kinds of tasks, those of all subdomains together: "sweep 71 % + glue 12 %".
std::string path_by_kind(const trace::Summary& summary) {
  std::map<std::string, double> kinds;
  for (const trace::PathShare& share : summary.path)
    kinds[share.what.substr(0, share.what.find(" of subdomain"))] += share.time;
  std::vector<std::pair<double, std::string>> sorted;
  for (const auto& [kind, time] : kinds) sorted.emplace_back(time, kind);
  std::ranges::sort(sorted, std::greater<>());
  std::string text;
  for (std::size_t k = 0; k < std::min<std::size_t>(3, sorted.size()); ++k)
    text += fmt::format("{}{} {:.0f} %", k > 0 ? " + " : "", sorted[k].second,
                        100 * sorted[k].first / summary.path_time);
  return text;
}

void describe_replay(const trace::Summary& summary, ScalingRow& row) {
  const double all = summary.makespan * summary.ranks * summary.threads;
  row.balance = summary.efficiency.load_balance;
  row.communication = summary.efficiency.communication;
  row.within = summary.efficiency.threads;
  row.exposed = summary.exposed / all;
  for (std::size_t p = 0; p < row.share.size(); ++p) row.share[p] = summary.phase[p] / all;
  row.path = path_by_kind(summary);
}

}  // namespace

const std::vector<ScalingNetwork>& scaling_networks() {
  static const std::vector<ScalingNetwork> networks = {
      {"today", "1.5 us, 12.5 GB/s a node of 32 ranks (100 Gbit/s), 0.3 us a message for the core",
       network_machine(1.5e-6, 12.5e9, 3e-7, 32, 5e-7, 10e9)},
      {"2012", "2 us, 3.2 GB/s a node of 12 ranks (InfiniBand QDR), 0.7 us a message for the core",
       network_machine(2e-6, 3.2e9, 7e-7, 12, 8e-7, 4e9)},
      {"node", "all ranks on one node: 0.5 us, 10 GB/s a message, 0.3 us a message for the core",
       network_machine(5e-7, 10e9, 3e-7, 1 << 20, 5e-7, 10e9)}};
  return networks;
}

ScalingNetwork scaling_network(const std::string& name) {
  std::string known;
  for (const ScalingNetwork& network : scaling_networks()) {
    if (network.name == name) return network;
    known += (known.empty() ? "" : ", ") + network.name;
  }
  throw std::invalid_argument(fmt::format("there is no network '{}': {}", name, known));
}

std::vector<ScalingRow> predict(const ScalingTraces& traces, std::span<const ScalingMachine> machines,
                                std::span<const ScalingNetwork> networks, bool typical, double quantile) {
  // Rows of all repeats of a machine, each with the seconds of its own trace.
  std::vector<std::vector<ScalingRow>> repeats(machines.size() * networks.size());
  for (std::size_t k = 0; k < traces.files.size(); ++k) {
    const trace::Trace recorded = io::read_trace(traces.files[k]);
    const trace::Timeline timeline(recorded);
    const auto steps = static_cast<double>(timeline.steps().size());
    for (std::size_t n = 0; n < networks.size(); ++n)
      for (std::size_t m = 0; m < machines.size(); ++m) {
        trace::Machine machine = networks[n].machine;
        machine.ranks = machines[m].ranks;
        machine.threads = machines[m].threads;
        // Ranks with several threads have as many cores as those with one.
        machine.ranks_per_node = std::max(1, machine.ranks_per_node / machine.threads);
        machine.typical = typical;
        machine.quantile = quantile;
        const trace::Replay played = trace::replay(timeline, machine, true);
        ScalingRow row = row_of(traces.subject, machines[m], {traces.times[k]});
        row.source = ScalingSource::replay;
        row.network = networks[n].name;
        row.seconds = 1e-9 * played.makespan / steps;
        describe_replay(trace::analyse(played.trace), row);
        repeats[n * machines.size() + m].push_back(std::move(row));
      }
  }
  std::vector<ScalingRow> rows;
  for (std::vector<ScalingRow>& of_machine : repeats) {
    std::ranges::sort(of_machine, {}, &ScalingRow::seconds);
    // The repeat in the middle, with its shares and its path.
    ScalingRow row = of_machine[(of_machine.size() - 1) / 2];
    row.repeats = static_cast<int>(of_machine.size());
    row.fastest = of_machine.front().seconds;
    row.slowest = of_machine.back().seconds;
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace talus
