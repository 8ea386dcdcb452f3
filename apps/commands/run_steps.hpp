#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/commands/run.hpp"
#include "apps/commands/run_resume.hpp"
#include "apps/shared/terminal.hpp"
#include "io/results/run_json.hpp"
#include "io/scene/scene.hpp"
#include "kernels/samples/sample.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/trace/order.hpp"
#include "runtime/trace/task_times.hpp"

namespace talus {

/// Of earlier runs, that this one goes by; null: not asked for.
struct Recordings {
  std::unique_ptr<trace::Order> order;
  std::unique_ptr<trace::TaskTimes> times;
};

/// A run whose options and scene have been checked on all ranks, and whose directory is prepared.
struct PreparedRun {
  const RunOptions& options;
  const io::Scene& scene;
  const Recordings& recordings;
  const graph::Communicator& ranks;
  const Terminal& terminal;
  ResumePoint* resume = nullptr;           ///< null: from the beginning; its state goes into the simulation
  std::string resolved = {};               ///< the scene as it was loaded, before its walls were placed
  double wall_mass = 0;                    ///< io::automatic_wall_mass of the sample [kg]; rank 0's
  double began = 0;                        ///< clock when the process began (graph::seconds_now)
  std::optional<double> granted = {};      ///< time from then to when it must have ended [s]
  std::string directory;                   ///< of the results
  io::Provenance provenance;               ///< with the number of threads
  std::vector<std::string> warnings = {};  ///< of the scene; rank 0's
};

/// Collective. Runs from the first file of the results to the last; rank 0 has the sample, and the forces
/// that it begins from. What breaks the run off is in the summary. Throws what the constructor of
/// io::Recorder throws.
io::Summary simulate(const PreparedRun& run, Sample sample, std::vector<GivenForce> forces);

}  // namespace talus
