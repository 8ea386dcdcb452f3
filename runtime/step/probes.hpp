#pragma once

/// Probes: what is in a region, and what goes through a surface, from time to time (docs/theory.md,
/// "Probes"). A scene without them does none of it.

#include <cstdint>
#include <vector>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/passages.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// State that outlives a step, as numbers that a checkpoint can hold. Of p probes and m materials.
struct ProbeState {
  std::vector<std::int64_t> count;       ///< p x m: passages along the normal less those against it
  std::vector<double> mass;              ///< p x m [kg]
  std::vector<std::int64_t> count_told;  ///< p: sums over the materials at the last report
  std::vector<double> mass_told;         ///< p [kg]
  std::vector<double> time_told;         ///< p: of the last report [s]
  std::vector<std::int64_t> passed;      ///< p: multiples of ProbeRule::every that have passed

  /// visit(name, member) for each member of a state, which may be const.
  template <class Self, class Visit>
  static void each_number(Self& self, const Visit& visit) {
    visit("probe_count", self.count);
    visit("probe_mass", self.mass);
    visit("probe_count_told", self.count_told);
    visit("probe_mass_told", self.mass_told);
    visit("probe_time_told", self.time_told);
    visit("probe_passed", self.passed);
  }
};

/// The step that has been made.
struct ProbedStep {
  std::int64_t step = 0;
  double time = 0;          ///< [s] at its end
  double impulse_time = 0;  ///< [s] forces are impulses over it
  bool dealt = false;       ///< bodies may stand in other slots and on other ranks than before
};

class Probes {
 public:
  /// Keeps a reference.
  explicit Probes(const Setup& setup);
  /// From a checkpoint. Throws std::invalid_argument when the checkpoint has other probes.
  void go_on_from(const ProbeState& state);
  const ProbeState& state() const { return now_; }

  /// Before a step, when grains have come and gone.
  void begin_step(const StepState& state);
  /// After it. Collective.
  void end_step(const ProbedStep& step, const StepState& state, const graph::Communicator& ranks);
  /// Reports of the probes that were due after the last step, in the order of the setup. The same on all
  /// ranks.
  const std::vector<ProbeReport>& reports() const { return reports_; }

 private:
  bool is_due(std::size_t probe, const ProbedStep& step);
  void report_contents(const std::vector<std::size_t>& due, const ProbedStep& step, const StepState& state,
                       const graph::Communicator& ranks);
  void report_passages(std::size_t probe, double time, ProbeReport& report);

  const Setup& setup_;
  std::size_t materials_;
  bool any_surface_ = false;
  Passages passages_;
  ProbeState now_;
  std::vector<ProbeReport> reports_;
};

}  // namespace talus
