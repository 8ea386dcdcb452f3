#pragma once

#include <cstdint>
#include <vector>

#include "kernels/detection/skin_escape.hpp"
#include "runtime/graph/epoch_loop.hpp"
#include "runtime/graph/executor.hpp"
#include "runtime/graph/graph.hpp"
#include "runtime/step/solver_loop.hpp"
#include "runtime/step/state.hpp"
#include "runtime/trace/recorder.hpp"

namespace talus::trace {
class Order;
}

namespace talus {

struct Checkpoint;

/// Elapsed time of the parts of a step [s].
struct StepTimes {
  double detection = 0;  ///< predicted poses, broad and narrow phase, chunks, matching
  double iteration = 0;  ///< the epoch loop
  double small = 0;      ///< part of iteration: answers of small clusters (certificate.hpp)
  double rest = 0;       ///< integration and measures
  double dealing = 0;    ///< part of detection: partition, migration, interfaces, plan of the exchange
};

/// What the tasks of a step leave for its report.
struct StepSums {
  MotionSums motion;
  ContactSums contacts;
  bool broad_phase = false;     ///< candidates were found anew
  bool bodies_beyond = false;   ///< at its end some have come further than candidates were looked for
  bool walls_beyond = false;    ///< likewise
  std::int64_t migrants = 0;    ///< copies that came to a subdomain where their body did not stand
  std::int64_t candidates = 0;  ///< of all ranks
  StepTimes times;
};

/// The task graph of a time step, built once and run every step:
///
///   predict[share] -> cells -> pairs[share] -> chunks -> narrow[share] -> plan -> iterate (team) ->
///   finish[share], walls -> measure[share] -> sum
///
/// A share is a fixed share of the bodies of a subdomain, or of this rank's cells or chunks; the number of
/// shares of a subdomain depends on the number of all bodies and subdomains only, so that sums are the same
/// for any number of threads and ranks. cells, pairs and chunks return at once while every grain and wall is
/// within its margin of the last broad phase, or while the few grains that have left theirs meet none but
/// their candidates. Otherwise candidates are found anew; with several subdomains cells then collects the
/// bodies around them, and chunks deals bodies out anew.
/// Each task declares what it reads and writes; the order above follows from that.
class StepGraph {
 public:
  /// Keeps references. `shares`: of each subdomain.
  StepGraph(StepState& state, const StepParameters& parameters, const Setup& setup, std::uint32_t shares,
            graph::Executor& executor, const graph::Communicator& ranks);
  /// Shares of a subdomain, from the bodies of all ranks that there are or may come.
  static std::uint32_t shares_for(std::int64_t bodies, std::int32_t subdomains);

  /// One step: poses, velocities, walls, impulses of `state` go from the beginning to the end of the step.
  /// On entry the walls' free velocities and applied forces are set. Throws graph::TaskError.
  void run();

  /// From now on nodes of the loop begin in the order of `order`, in the steps that it holds; null ends this.
  /// Throws std::invalid_argument when it is of other ranks x threads. It must outlive the steps.
  void follow(trace::Order* order);

  /// Writes what outlives a step besides the state into the head and the parts of `to` (save_state).
  void save(Checkpoint& to) const;
  /// Continues from a checkpoint, after restore_state: cuts the chunks of the state and fills its contacts.
  /// Collective.
  void restore(const Checkpoint& from);

  /// Between steps: gives back the memory that only detection and iterations use; the next step takes it
  /// anew. What is read of the last step's contacts stays, but for b.
  void release_room();

  const StepSums& sums() const { return sums_; }
  const SolverLoop& loop() const { return loop_; }
  const graph::Graph& graph() const { return graph_; }
  std::uint32_t shares() const { return shares_; }
  std::uint32_t shares_of_subdomain() const { return shares_per_subdomain_; }

 private:
  void build();
  void take_room();
  void predict_share(std::uint32_t share);
  void find_free_velocities(SlotRange range);
  void find_flow_escape(SlotRange range, std::uint32_t share);
  std::vector<double> speeds() const;
  void wrap_bodies();
  bool partition_due() const;
  bool needs_broad_phase();
  bool candidates_hold() const;
  void make_cells();
  void sort_into_cells(std::span<const Vec3> x, std::span<const double> reach);
  void find_pairs_of_share(std::uint32_t share);
  void make_chunks();
  Candidates take_given_forces();
  void set_up_chunks(std::span<const CandidateGroup> groups);
  void renew_slots();
  void narrow_share(std::uint32_t share);
  void plan_iteration();
  void iterate(graph::Worker& worker);
  std::vector<trace::Task> declared_tasks() const;
  void note_plan(const graph::LoopPlan& loop);
  trace::Plan describe_plan(const graph::LoopPlan& loop) const;
  void finish_share(std::uint32_t share);
  void finish_walls();
  template <class Otherwise>
  std::vector<double> copies_of_walls(const std::vector<WallCopy>& copies, const Otherwise& otherwise) const;
  void measure_share(std::uint32_t share);
  void take_wall_sums(std::span<const double> sums);
  void sum_up();
  SlotRange range_of_share(std::size_t count, std::uint32_t share) const;
  SlotRange slots(std::uint32_t share) const;
  double margin_of(std::size_t w) const;
  double way_of_wall(std::size_t w) const;
  bool walls_left_margin() const;
  bool walls_beyond_margin() const;
  bool out_of_balance() const;
  std::vector<double> work() const;
  Per<SubdomainId, double> costs(std::span<const double> work) const;

  StepState& state_;
  const StepParameters& parameters_;
  const Setup& setup_;
  const SolverSettings& settings_;
  const DecompositionSettings& decomposition_;
  graph::Executor& executor_;
  const graph::Communicator& ranks_;
  std::uint32_t shares_per_subdomain_;
  std::uint32_t shares_;
  graph::Graph graph_;
  SolverLoop loop_;
  graph::EpochGraph epochs_;
  trace::Order* order_ = nullptr;
  bool followed_ = false;                              ///< this step goes by order_
  bool planned_ = false;                               ///< false: the chunks are new
  double started_ = 0, iterating_ = 0, iterated_ = 0;  ///< clock at begin, before and after the loop [s]
  Surroundings around_;                       ///< several subdomains: bodies among which candidates are found
  std::int64_t all_candidates_ = 0;           ///< of all ranks
  std::int64_t steps_ = 0, partitioned_ = 0;  ///< steps done, now and when the partition was made
  double imbalance_then_ = 0;                 ///< least imbalance since the partition was made
  std::int64_t contacts_before_ = 0;          ///< of all ranks, in the last step
  double imbalance_before_ = 0;               ///< SolverLoop::imbalance of the last step
  CellGrid cells_;
  std::vector<Slot> images_;               ///< ImagedBodies::original; empty between walls
  std::vector<double> wall_margin_;        ///< at the last broad phase [m]
  std::vector<std::vector<Escape>> left_;  ///< per share: grains that have used up their margins
  std::vector<std::vector<GrainPair>> pairs_;
  std::vector<MotionSums> motion_;
  std::vector<char> beyond_reach_;         ///< per share: whether one of its bodies is (StepSums)
  std::vector<ContactSums> contact_sums_;  ///< per chunk
  std::vector<WallSums> wall_sums_;        ///< per chunk
  StepSums sums_;
};

}  // namespace talus
