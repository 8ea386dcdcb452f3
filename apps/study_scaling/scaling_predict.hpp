#pragma once

/// What traces say of machines that are not there.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/study_scaling/scaling_runs.hpp"
#include "runtime/trace/replay.hpp"

namespace talus {

/// A network with a name; the fields of Machine that are not of messages are not used.
struct ScalingNetwork {
  std::string name, description;
  trace::Machine machine;
};

/// "today": 100 Gbit/s, nodes of 32 ranks; "2012": InfiniBand QDR, nodes of 12 ranks, as was usual when the
/// paper was written; "node": all ranks on one node.
const std::vector<ScalingNetwork>& scaling_networks();

/// Throws std::invalid_argument that lists the names there are.
ScalingNetwork scaling_network(const std::string& name);

/// Traces of one subject with one number of subdomains, recorded at 1 x 1.
struct ScalingTraces {
  ScalingSubject subject;
  int subdomains = 1;
  std::vector<std::filesystem::path> files;  ///< repeats
  std::vector<RunTimes> times;               ///< of each
};

/// Plays every trace on every machine: a row per machine and network, medians over the traces. Machines have
/// as many subdomains as the traces. Throws what read_trace and replay throw.
std::vector<ScalingRow> predict(const ScalingTraces& traces, std::span<const ScalingMachine> machines,
                                std::span<const ScalingNetwork> networks, bool typical, double quantile);

}  // namespace talus
