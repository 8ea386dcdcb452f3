#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace talus {

struct PartitionCommandOptions {
  std::string scene;                      ///< path of the scene file
  std::int32_t subdomains = 1;            ///< >= 1
  std::vector<std::string> partitioners;  ///< names (partition/partitioner.hpp); empty: all but "auto"
  std::string out;                        ///< directory of the files; empty: out/partition-NAME of the scene
  bool force = false;                     ///< replace the files of an earlier `talus partition` in `out`
  int threads = 0;                        ///< 0: one per core this process may use
  std::vector<std::string> overrides;     ///< "a.b=c"
};

/// `talus partition`: cuts the sample of a scene into subdomains with each partitioner, prints what they hold
/// side by side (Table 4 of Visseq, Alart and Dureisseix 2013), and writes partition_NAME.vtp and
/// partition_NAME.svg (their Figure 6) for each. What it prints and writes does not depend on the threads.
/// Returns an ExitCode.
int partition_command(const PartitionCommandOptions& options);

}  // namespace talus
