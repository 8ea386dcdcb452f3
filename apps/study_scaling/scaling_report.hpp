#pragma once

/// What a scaling study leaves beside its scenes and traces.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/shared/report_page.hpp"
#include "apps/study_scaling/scaling_predict.hpp"

namespace talus {

/// A speedup from elsewhere, drawn beside the study's own.
struct OtherSpeedup {
  std::string name;  ///< those of one name are a curve
  double cores = 1, speedup = 1;
};

/// Reads lines "name,cores,speedup" under a header of these words; lines with '#' are skipped. Throws
/// io::SceneError with file and line.
std::vector<OtherSpeedup> read_speedups(const std::string& path);

/// The same study by hand.
struct ScalingCommands {
  std::string lines;  ///< for a shell: runs and traces of strong scaling
  std::string slurm;  ///< a job script for a cluster, begun in the folder of the study
};

/// `subdomains` ascending.
ScalingCommands scaling_commands(const ScalingLauncher& launcher, const std::vector<int>& subdomains,
                                 int repeat);

struct ScalingReport {
  std::string name, description;
  std::vector<ScalingNetwork> networks;
  std::vector<OtherSpeedup> beside;
  std::int64_t first = 1, last = 1;
  int record = 1;
  bool own_caches = false, typical = false;
  double quantile = 0;
  ScalingCommands commands;
  std::vector<ScalingRow> rows;  ///< related
};

/// True for the names of files that `talus study scaling` may have written: those of write_scaling_report,
/// and scenes and traces.
bool is_study_scaling_name(const std::string& name);

/// Writes commands.sh and slurm.sh, and once there are rows the tables, pictures and report.html.
/// Throws io::FileError.
void write_scaling_report(const std::filesystem::path& directory, const ScalingReport& report);

}  // namespace talus
