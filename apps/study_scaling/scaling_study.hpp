#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "apps/study_scaling/scaling_plan.hpp"
#include "apps/study_scaling/scaling_predict.hpp"
#include "apps/study_scaling/scaling_runs.hpp"
#include "apps/study_scaling/study_scaling.hpp"

namespace talus {

/// Runs, recordings and predictions of a scaling study, as rows. Says on stderr what it does. Methods throw
/// what run_once, record_once, simulate_once and predict throw.
class ScalingStudy {
 public:
  using Keep = std::function<void(const std::vector<ScalingRow>&)>;

  /// In `directory`, which is absolute and holds the traces of `recordings` (an earlier study; empty: none).
  /// `keep` is called with all rows whenever there are new ones.
  ScalingStudy(const StudyScalingOptions& options, ScalingPlan plan, std::filesystem::path directory,
               std::vector<RecordedTrace> recordings, Keep keep);

  /// The whole study of one sample that stays as it is.
  void strong(const ScalingSubject& subject);

  /// What was recorded of this scene does not hold any more. The list says so before anything else happens: a
  /// study may be killed.
  void forget(const std::string& scene);

  /// The sample of `n` cores, with as many grains a core as those of the others.
  void weak(const ScalingSubject& subject, int n);

  const std::vector<ScalingRow>& rows() const { return rows_; }
  const ScalingLauncher& launcher() const { return launcher_; }

 private:
  /// Runs on every number of cores, a subdomain a core, divided into ranks and threads in all ways. Machines
  /// take turns, so that what disturbs one disturbs all.
  void measure(const ScalingSubject& subject, const std::vector<int>& cores);
  void keep();
  void simulate(const ScalingSubject& subject, int n, const ScalingNetwork& network);

  /// One core has the whole sample in its caches, or has not.
  bool own_caches(const ScalingTraces& traces) const { return plan_.own_caches && traces.subdomains > 1; }

  /// Recordings take turns as runs do.
  void record(std::vector<ScalingTraces>& all);
  /// Of an earlier study, or recorded now.
  RunTimes recorded(const std::string& name, const std::filesystem::path& file, const ScalingTraces& traces);
  void predict_from(const ScalingTraces& traces);
  void add(const std::vector<ScalingRow>& rows);

  ScalingPlan plan_;
  std::filesystem::path directory_;
  ScalingLauncher launcher_;
  SimulatedLauncher simulated_;
  std::vector<RecordedTrace> recordings_;
  Keep keep_;
  std::vector<ScalingRow> rows_;
};

}  // namespace talus
