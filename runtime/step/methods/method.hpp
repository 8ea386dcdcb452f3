#pragma once

/// Methods: how sweeps go on from one to the next, and when ADMM takes over. Whether a step is solved is not
/// their decision but the certificate's. Each method has a file of its own beside this one;
/// methods/registry.cpp lists them.

#include <memory>
#include <optional>

#include "kernels/registry.hpp"
#include "runtime/step/methods/sweep_plan.hpp"
#include "runtime/step/setup.hpp"

namespace talus {

/// What a method knows of its problem before it begins. Constant during a step.
struct MethodContext {
  const SolverSettings& settings;
  bool friction = false;
  /// True where sweeps cannot be accelerated: damped Schwarz does not decrease the energy, and no history is
  /// kept of moments of rolling resistance and of contacts of clumps.
  bool plain = false;
};

/// What a check of a step tells its method about the problem as a whole. Answers beyond the counts may cost
/// as much as a hundred sweeps, are collective, and are asked for in the same order by all ranks.
class MethodView {
 public:
  virtual ~MethodView() = default;
  virtual int sweeps_since_start() const = 0;  ///< of the step, or since ADMM
  virtual int admm_calls() const = 0;          ///< in this step
  virtual double sweeps_needed() = 0;          ///< about, of the present kind, in this step
  virtual bool checks_velocities() = 0;        ///< Certificate::checks_velocities
  virtual bool balanced() = 0;                 ///< Certificate::balanced
};

/// Calls of a step, all at gates of the loop:
///
///   begin()                 before the first sweep
///   after_check(), calls_admm()   after each check that has not ended the step, in this order
///   after_admm()            after ADMM, or after a Newton step: before the next sweep
///   after_stagnation()      after a check that found stagnation, instead of after_check()
///
/// Methods keep nothing between calls: what is in force comes in as the plan.
class Method {
 public:
  virtual ~Method() = default;

  virtual SweepPlan begin() const = 0;
  /// A new plan, which begins with the next sweep; none: go on. `growth`: the error over that of
  /// the check before.
  virtual std::optional<SweepPlan> after_check(const SweepPlan& now, double growth) const;
  /// Another plan, where the method has one.
  virtual std::optional<SweepPlan> after_stagnation(const SweepPlan& now) const;
  virtual SweepPlan after_admm(const SweepPlan& now) const { return now; }
  virtual bool calls_admm(MethodView& view) const;
  /// Whether the Newton step with which a check has found small clusters of contacts in error is taken.
  virtual bool corrects() const { return false; }
};

inline std::optional<SweepPlan> Method::after_check(const SweepPlan&, double) const {
  return std::nullopt;
}
inline std::optional<SweepPlan> Method::after_stagnation(const SweepPlan&) const {
  return std::nullopt;
}
inline bool Method::calls_admm(MethodView&) const {
  return false;
}

/// When sweeps hand over to ADMM.
struct AdmmCalls {
  /// Sweeps done before the first call, >= 0; four times as many before each further one.
  int chance = 50;
  /// Calls in a step, at most, >= 1: ADMM is called again for a problem that it has not solved.
  int most = 3;
};
/// Enough sweeps were done since the last call of ADMM, and another call is allowed in this step.
bool admm_due(const AdmmCalls& calls, const MethodView& view);

using MethodMaker = std::unique_ptr<Method> (*)(const MethodContext&);
/// All methods: solver.method in scenes, --method in studies.
const Registry<SolverMethod, MethodMaker>& methods();

}  // namespace talus
