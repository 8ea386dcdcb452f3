#pragma once

#include <memory>
#include <vector>

#include "kernels/global/admm.hpp"
#include "kernels/global/body_parts.hpp"
#include "kernels/global/step_reader.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/graph/crew.hpp"
#include "runtime/step/certificate.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/step/state.hpp"
#include "runtime/step/worst_errors.hpp"
#include "runtime/trace/recorder.hpp"
#include "runtime/trace/trace.hpp"

namespace talus {

/// What ADMM is asked for, and when its impulses are dropped (GlobalSolver::improve). Masses too far apart
/// for the digits of its linear system can carry it off.
struct ImprovementThresholds {
  /// The balance that it is asked for, over that of the step, in (0, 1).
  double finer = 0.1;
  /// Binary digits by which it is to be more exact with each further call in a step, >= 1: the last was not
  /// enough.
  int digits = 2;
  /// Its momentum defect, at most, > 1: near 1 where light bodies have yet to follow a heavy one.
  double most_defect = 2;
  /// The energy that it leaves, at most, over what there is without contacts, >> 1: contacts make none, but
  /// until sweeps follow it leaves light bodies with what heavy ones had.
  double most_energy = 1e8;
};

/// What looks at all contacts of a step at once: how stiff they are, how far their impulses are from an
/// answer, ADMM (kernels/global), and the answers of small clusters (kernels/clusters). Each subdomain is a
/// part of the problem: it holds its own contacts and bodies, masses whole; what copies have to agree on goes
/// the way of the gluing, and sums are gathered as rows by subdomain. So the bits depend on the partition
/// alone, and a rank holds no more than its own subdomains, the coarse level, and clusters that lie in them.
///
///   between two epochs, at a gate of all ranks:  improve() or correct();  next epoch: V afresh from r
///   threads that wait at the gate:               assist()
class GlobalSolver {
 public:
  /// Keeps references.
  GlobalSolver(StepState& state, const StepParameters& parameters, const DecompositionSettings& decomposition,
               Gluing& gluing, const graph::Communicator& ranks);

  /// Of a thread that waits for the one that calls: takes its share of the subdomains.
  void assist() { crew_.help(); }

  // Collective.
  /// About the number of Gauss-Seidel sweeps that the problem needs: estimate_stiffness; in a cell without
  /// walls, by its size. `spread`: the mass of the heaviest grain over that of the lightest.
  double sweeps_needed(double spread) const;

  /// Finds the clusters of the step's contacts, and which are small. `twice`: what is asked of the large ones
  /// is asked of all.
  void find_clusters(const SmallClusters& small, bool twice);
  bool small_clusters() const { return small_; }  ///< there are some, in any part
  bool large_clusters() const { return large_; }
  bool several_large_clusters() const { return groups_.count > 1; }

  /// Relative error of what the impulses of the last check give, with several ranks those that the candidates
  /// keep; what is below `enough` is not told apart. `sweeps`: done in this step. `farthest`: largest
  /// coordinate [m], which rounding goes by. In small clusters of velocities and forces
  /// (kernels/clusters/step_error.hpp); what would mend them is kept for `correct`. In large ones of
  /// velocities (balance.hpp).
  SmallError small_error(double enough, int sweeps, double farthest);
  /// What these answers have taken since this was asked last [s].
  double take_small_seconds();
  double large_error(double enough) const;
  /// Of large clusters, and the same impulses: kernels/clusters/cluster_work.hpp.
  double large_work(double speed, double interest) const;
  /// Of the same impulses: the residual that a share `part` of all contacts does not exceed, and what is
  /// furthest from its law (kernels/global/residuals.hpp).
  double quantile_error(double part) const;
  WorstErrors worst_errors() const;

  /// Whether the last small_error has found what mends clusters that are wrong. `correct` puts it into
  /// `state.contacts`; velocities are left to be made afresh.
  bool correction_helps() const { return mends_; }
  void correct();
  /// Between steps: gives back what was kept for `correct`.
  void release_room();

  /// Replaces the impulses of `state.contacts` by better ones, finer in their balance than `tolerance`.
  /// Velocities are left to be made afresh. `calls`: before in this step.
  BodyAdmmResult improve(double tolerance, int calls, const ImprovementThresholds& thresholds = {});

 private:
  class Whole;  ///< a span of it in a trace
  /// gather(source), or gather(source, part) of each subdomain.
  template <class Gather>
  auto gather_parts(const BodyProblemSource& source, const Gather& gather) const;
  std::vector<ContactGraph> gather_graphs() const;
  std::vector<BodyProblem> gather() const;
  /// The problem with the impulses of the last check, read from the arrays of the step, which `source` names.
  std::vector<std::unique_ptr<const StepReader>> read_checked(const BodyProblemSource& source) const;
  ProblemReaders read_all_checked(const BodyProblemSource& source) const;
  /// The same with the contacts of small or of large clusters alone, put together.
  std::vector<BodyProblem> checked(bool small) const;

  StepState& state_;
  const StepParameters& parameters_;
  const DecompositionSettings& decomposition_;
  const graph::Communicator& ranks_;
  graph::Crew crew_;
  mutable trace::Meetings rounds_;    ///< since the last span began
  mutable trace::SharedWork shared_;  ///< likewise
  std::unique_ptr<PartLink> link_;
  std::vector<std::vector<char>> in_small_;  ///< per part and unknown
  BodyGroups groups_;                        ///< the large clusters
  bool small_ = false, large_ = false, twice_ = false;
  std::vector<BodyProblem> problems_;  ///< of the last small_error
  PartImpulses change_, moments_;      ///< found there [N s, N m s]
  bool mends_ = false;
  double small_seconds_ = 0;  ///< take_small_seconds
};

/// The contact problem of the step that the state stands in or behind, with the impulses that it has found.
/// One subdomain.
BodyProblem contact_problem(const StepState& state, const StepParameters& parameters);

}  // namespace talus
