#pragma once

#include <cstdint>
#include <vector>

#include "runtime/graph/epoch_loop.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/graph/graph.hpp"
#include "runtime/step/iteration.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Elapsed time of the parts of a step [s].
struct StepTimes {
  double detection = 0;  ///< predicted poses, broad and narrow phase, chunks, matching
  double iteration = 0;  ///< the epoch loop
  double rest = 0;       ///< integration and measures
};

/// What the tasks of a step leave for its report.
struct StepSums {
  MotionSums motion;
  ContactSums contacts;
  bool broad_phase = false;  ///< candidates were found anew
  StepTimes times;
};

/// The task graph of a time step, built once and run every step:
///
///   predict[lane] -> cells -> pairs[lane] -> chunks -> narrow[lane] -> plan -> iterate (team) ->
///   finish[lane], walls -> measure[lane] -> sum
///
/// A lane is a fixed share of the bodies, the cells or the chunks; their number depends on the number of
/// bodies only, so that sums are the same for any number of threads. cells, pairs and chunks return at once
/// while every grain and wall is within its margin of the last broad phase. Each task declares what it reads
/// and writes; the order above follows from that.
class StepGraph {
 public:
  /// Keeps references.
  StepGraph(StepState& state, const StepParameters& parameters, const SolverSettings& settings,
            graph::Executor& executor);

  /// One step: poses, velocities, walls, impulses of `state` go from the beginning to the end of the step.
  /// On entry the walls' free velocities and applied forces are set. Throws graph::TaskError.
  void run();

  const StepSums& sums() const { return sums_; }
  const Iteration& iteration() const { return iteration_; }
  const graph::Graph& graph() const { return graph_; }
  std::uint32_t lanes() const { return lanes_; }

 private:
  void build();
  void predict_lane(std::uint32_t lane);
  void make_cells();
  void find_lane_pairs(std::uint32_t lane);
  void make_chunks();
  void narrow_lane(std::uint32_t lane);
  void plan_iteration();
  void plan_epochs();
  void finish_lane(std::uint32_t lane);
  void finish_walls();
  void measure_lane(std::uint32_t lane);
  void sum_up();
  SlotRange share(std::size_t count, std::uint32_t lane) const;
  double margin_of(const Wall& wall) const;
  bool walls_left_margin() const;

  StepState& state_;
  const StepParameters& parameters_;
  const SolverSettings& settings_;
  graph::Executor& executor_;
  std::uint32_t lanes_;
  graph::Graph graph_;
  Iteration iteration_;
  graph::EpochGraph epochs_;
  std::vector<std::int32_t> planned_walls_;            ///< glued walls that epochs_ was built for
  bool planned_ = false;                               ///< false: the chunks are new
  double started_ = 0, iterating_ = 0, iterated_ = 0;  ///< clock at the seams of the step [s]
  CellGrid cells_;
  std::vector<double> wall_margin_;  ///< at the last broad phase [m]
  std::vector<char> left_;           ///< per lane: a grain left its margin
  std::vector<std::vector<GrainPair>> pairs_;
  std::vector<MotionSums> motion_;
  std::vector<ContactSums> contact_sums_;
  StepSums sums_;
};

}  // namespace talus
