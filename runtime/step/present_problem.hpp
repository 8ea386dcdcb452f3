#pragma once

#include "runtime/step/answer_memory.hpp"
#include "runtime/step/certificate.hpp"
#include "runtime/step/courses.hpp"
#include "runtime/step/global_solver.hpp"
#include "runtime/step/stiffness_memory.hpp"
#include "runtime/step/velocity_error_memory.hpp"

namespace talus {

/// The problem of the present step, as the certificate asks about it.
class PresentProblem final : public WholeProblem {
 public:
  /// Keeps references.
  PresentProblem(const StepState& state, GlobalSolver& global, const Courses& courses,
                 const Certificate& certificate)
      : state_(state), global_(global), courses_(courses), certificate_(certificate) {}

  /// Collective, where candidates were found anew.
  void plan(const graph::Communicator& ranks);
  /// Of each step.
  void begin() {
    stiffness_.begin_step();
    clusters_known_ = false;
  }

  /// The step has ended.
  void end() {
    const IterationResult& result = certificate_.result();
    velocity_errors_.swept(result.iterations);
    answers_.ended(result.answers != AnswerState::found && !result.converged);
  }

  double plain_sweeps_needed() override;
  double speed() const override { return speed_of(courses_.now().plan); }
  bool small_clusters() override {
    find_clusters();
    return global_.small_clusters();
  }
  bool large_clusters() override {
    find_clusters();
    return global_.large_clusters();
  }
  bool several_large_clusters() override {
    find_clusters();
    return global_.several_large_clusters();
  }
  double large_work(double speed, double interest) override { return global_.large_work(speed, interest); }
  SmallError small_error(double enough, int sweeps) override {
    return global_.small_error(enough, answers_.credited(sweeps), farthest_);
  }
  double large_error(double enough) override { return global_.large_error(enough); }
  VelocityErrorMemory& velocity_errors() override { return velocity_errors_; }
  double quantile_error(double part) override { return global_.quantile_error(part); }
  WorstErrors worst_errors() override { return global_.worst_errors(); }

  bool grains_alike() const { return stiffness_.grains_alike(); }
  const StiffnessMemory& stiffness() const { return stiffness_; }
  const VelocityErrorMemory& velocity_errors() const { return velocity_errors_; }
  const AnswerMemory& answers() const { return answers_; }
  /// As of the last plan() [m].
  double farthest() const { return farthest_; }
  /// What was learned of earlier problems; behind plan() where there is one.
  void go_on_from(const StiffnessMemory& stiffness, const VelocityErrorMemory& velocity_errors,
                  const AnswerMemory& answers, double farthest) {
    stiffness_ = stiffness;
    velocity_errors_ = velocity_errors;
    answers_ = answers;
    farthest_ = farthest;
  }
  double candidates() const { return candidates_; }  ///< of all ranks
  /// Of the lightest grain of all ranks [1/kg].
  double largest_inv_mass() const { return largest_inv_mass_; }

 private:
  void find_clusters();

  const StepState& state_;
  GlobalSolver& global_;
  const Courses& courses_;
  const Certificate& certificate_;
  StiffnessMemory stiffness_;
  VelocityErrorMemory velocity_errors_;
  AnswerMemory answers_;
  bool clusters_known_ = false;  ///< of this step
  double candidates_ = 0;
  double farthest_ = 0;  ///< largest coordinate of a body [m]
  double largest_inv_mass_ = 0;
};

}  // namespace talus
