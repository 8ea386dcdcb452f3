#pragma once

/// What a scaling study leaves beside its scenes and traces.

#include <filesystem>
#include <string>
#include <vector>

#include "apps/shared/report_page.hpp"
#include "apps/study_scaling/scaling_plan.hpp"
#include "apps/study_scaling/scaling_runs.hpp"

namespace talus {

/// The same study by hand.
struct ScalingCommands {
  std::string lines;  ///< for a shell: runs and traces of strong scaling
  std::string slurm;  ///< a job script for a cluster, begun in the folder of the study
};

/// `subdomains` ascending.
ScalingCommands scaling_commands(const ScalingLauncher& launcher, const std::vector<int>& subdomains,
                                 int repeat);

struct ScalingReport {
  std::string name, description;  ///< of the scene
  ScalingPlan plan;
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
