#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/study_scaling/scaling_predict.hpp"
#include "apps/study_scaling/study_scaling.hpp"

namespace talus {

/// A speedup from elsewhere, drawn beside the study's own.
struct OtherSpeedup {
  std::string name;  ///< those of one name are a curve
  double cores = 1, speedup = 1;
};

/// Reads lines "name,cores,speedup" under a header of these words; lines with '#' are skipped. Throws
/// io::SceneError with file and line.
std::vector<OtherSpeedup> read_speedups(const std::string& path);

/// What a study does, once its options have been understood.
struct ScalingPlan {
  std::vector<int> strong, weak, hybrid;  ///< numbers of subdomains, ascending; hybrid: some of strong
  std::vector<ScalingNetwork> networks;
  std::vector<std::string> variants;  ///< without the one that is as the scene says
  std::vector<OtherSpeedup> beside;
  std::int64_t first = 1, last = 1;  ///< steps that count
  int cores = 1;                     ///< of this machine, for real runs
  bool own_caches = false, typical = false;
  double quantile = 0;
  int repeat = 5, record = 1;
};

/// Fills in what the options leave open. Throws std::invalid_argument with the option and the remedy, and
/// what read_speedups throws.
ScalingPlan plan_of(const StudyScalingOptions& options);

/// Numbers of cores for real runs on a machine that has `cores`: powers of two, and all of them.
std::vector<int> cores_to_measure(int cores);

}  // namespace talus
