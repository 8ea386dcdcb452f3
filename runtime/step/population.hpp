#pragma once

/// Inserts and removes grains between two steps.
///
/// Order within a step: loads of the stage, choice of the time step, removals, insertions, then detection,
/// which finds the candidates anew if any body came or went. A scene without rules skips all this.
///
/// The same on any ranks and threads: what is drawn is a function of the seed, the rule's number, the grain's
/// number within its rule and the attempt. All ranks draw the same places; each reports which of them its own
/// bodies occupy, and all then make the same choice. A grain goes to the rank and subdomain in which it lies,
/// and detection deals it out like any other. Ids increase and are never used again.
///
/// Sizes stay as they were drawn: a grain for which there is no room waits, and is tried again, so that large
/// grains are as frequent among those that came as in the distribution.

#include <cstdint>
#include <vector>

#include "kernels/samples/size_distribution.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/step/body_slots.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/places.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// State that outlives a step, as numbers that a checkpoint can hold. Of i insertions, r removals and m
/// materials.
struct PopulationState {
  std::int64_t next_id = 0;
  std::int64_t unsorted = 0;                ///< grains out of Morton order; with one subdomain only
  std::vector<std::int64_t> drawn;          ///< i: grains that were ever due
  std::vector<double> drawn_mass;           ///< i [kg]
  std::vector<std::int64_t> placed;         ///< i
  std::vector<double> placed_mass;          ///< i [kg]
  std::vector<std::int64_t> no_room;        ///< i: steps in which a grain found no room
  std::vector<std::int64_t> rounds;         ///< i: attempts that were ever made
  std::vector<std::int64_t> window;         ///< i: grains that are tried at an occasion
  std::vector<double> last;                 ///< i, then r: time of the last occasion [s]
  std::vector<std::int64_t> waiting_count;  ///< i
  std::vector<std::int64_t> waiting;        ///< numbers of grains due and not inserted, rule after rule
  std::vector<std::int64_t> passed;         ///< r: times of RemoveRule::at that have passed
  std::vector<std::int64_t> removed;        ///< r x m
  std::vector<double> removed_mass;         ///< r x m [kg]
  std::vector<std::int64_t> tracked_rule;   ///< of each grain whose path is reported: its insertion
  std::vector<std::int64_t> tracked_id;     ///< likewise

  /// visit(name, member) for each member of a state, which may be const.
  template <class Self, class Visit>
  static void each_number(Self& self, const Visit& visit) {
    visit("population_next_id", self.next_id);
    visit("population_unsorted", self.unsorted);
    visit("population_drawn", self.drawn);
    visit("population_drawn_mass", self.drawn_mass);
    visit("population_placed", self.placed);
    visit("population_placed_mass", self.placed_mass);
    visit("population_no_room", self.no_room);
    visit("population_rounds", self.rounds);
    visit("population_window", self.window);
    visit("population_last", self.last);
    visit("population_waiting_count", self.waiting_count);
    visit("population_waiting", self.waiting);
    visit("population_passed", self.passed);
    visit("population_removed", self.removed);
    visit("population_removed_mass", self.removed_mass);
    visit("population_tracked_rule", self.tracked_rule);
    visit("population_tracked_id", self.tracked_id);
  }
};

/// The time step that is about to be made.
struct StepSpan {
  double begin = 0, end = 0;  ///< [s]
  const Stage* stage = nullptr;
  double stage_began = 0;  ///< [s]
};

class Population {
 public:
  /// Keeps a reference. Collective: new ids follow the largest id of `bodies` on all ranks.
  Population(const Setup& setup, const Bodies& bodies, const graph::Communicator& ranks);
  /// From a checkpoint. Throws std::invalid_argument when the checkpoint has other rules.
  Population(const Setup& setup, const PopulationState& state);
  void go_on_from(const PopulationState& state);

  bool has_rules() const { return !setup_.inserts.empty() || !setup_.removes.empty(); }
  /// Removes and inserts grains at the beginning of the step. True when bodies came or went: candidates are
  /// then to be found anew. Collective.
  bool change(const StepSpan& step, StepState& state, const graph::Communicator& ranks);

  /// Whether an insertion that acts in the stage of the step has more grains to insert after the step.
  bool expects_grains(const StepSpan& step) const;
  /// Largest speed of a grain that may be inserted in the step [m/s].
  double fastest(const StepSpan& step) const;

  /// Bodies that came from an insertion that is tracked, named after it: NAME, or NAME-1, NAME-2, ...
  std::vector<NamedBody> tracked() const;
  std::vector<InsertReport> inserted() const;
  std::vector<RemoveReport> removed() const;
  PopulationState state() const;

 private:
  bool acts(const RuleTimes& times, const StepSpan& step) const;
  bool is_occasion(const RuleTimes& times, std::size_t rule, const StepSpan& step);
  double mass_of_grain(std::size_t rule, std::int64_t number) const;
  double radius_of_grain(std::size_t rule, std::int64_t number) const;
  std::vector<std::int64_t> leave(const StepSpan& step, const StepState& state,
                                  const graph::Communicator& ranks);
  void draw_due(std::size_t rule, const StepSpan& step);
  std::vector<Seeker> seekers_of(std::size_t rule) const;
  void place_due(std::size_t rule, const StepState& state, const graph::Communicator& ranks,
                 std::vector<NewGrain>& grains);
  NewGrain made(std::size_t rule, std::int64_t number, const Vec3& x);

  const Setup& setup_;
  PopulationState now_;                             ///< without the grains that wait:
  std::vector<std::vector<std::int64_t>> waiting_;  ///< per insertion
  std::vector<RadiusSource> radii_;                 ///< likewise
};

/// Smallest radius [m] that a grain ever has: in the sample, whose smallest is given (0: there is none), or
/// inserted.
double smallest_ever(const Setup& setup, double smallest_of_sample);

}  // namespace talus
