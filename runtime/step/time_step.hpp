#pragma once

/// The time step, where a stage leaves it to the program (time_step = "auto"; docs/theory.md, "Choice of the
/// time step"). Each step is the longest one divided by a power of two, and begins at a multiple of its
/// length. So a stage that ends by time ends exactly then, and the same motion gives the same steps on any
/// machine.
///
///   StageClock clock(bounds, end, begin);  at the beginning of a stage
///   clock.choose(longest);                 before each step, which then takes clock.step(): the least of
///                                          longest_time_step and longest_step_of_flow
///   clock.advance();                       after it

#include <cstdint>
#include <optional>

#include "runtime/graph/communicator.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Bounds on chosen time steps. Lengths are in smallest radii, ratios have no unit.
struct TimeStepRule {
  /// Part of the overlap tolerance for overlaps that cannot be foreseen when the step begins: a body struck
  /// in the step meets the next one at the speed that it has then. In (0, 1].
  double part_of_tolerance = 0.5;
  /// Longest path of a body, or of a wall into the grains, in a step, in (0, 0.5]: candidates are known that
  /// far, and two bodies that overlap by more have passed one another (StepReport::passed).
  double longest_way = 0.5;
  /// Largest strain of a periodic cell by its prescribed rates in a step, > 0.
  double longest_strain = 0.1;
  /// Steps in a period of a wall that oscillates, at least; > 2, so that it is seen at all.
  double steps_of_period = 20;
  /// Ratio of the longest to the shortest time step where the scene gives no shortest one, >= 1.
  double range = 1024;
};

/// Longest and shortest time step of a stage [s].
struct TimeStepBounds {
  double longest = 0, shortest = 0;
};

/// Bounds of a stage that chooses its time steps. By default the longest is the time in which a grain falls
/// by what the overlap tolerance leaves to it, or the shortest one that the stage asks for if that is longer.
/// `smallest`: radius [m].
TimeStepBounds time_step_bounds(const Stage& stage, const SolverSettings& solver, double smallest,
                                const TimeStepRule& rule = {});

/// The longest step that motion allows [s], infinity for a sample without motion and weight. `smallest`:
/// radius [m]. Collective; the same on any ranks, as a maximum over single bodies and pairs. One pass over
/// bodies and candidates.
double longest_time_step(const StepState& state, const Setup& setup, const StepParameters& parameters,
                         double smallest, const graph::Communicator& ranks, const TimeStepRule& rule = {});

/// The longest step that the prescribed flow of a periodic cell allows [s], infinity where nothing is
/// prescribed. What a stage changes of it begins within the step, when it does not show in velocities yet:
/// neighbours, `reach` apart at most [m], come nearer to one another by it as by overlaps that cannot be
/// foreseen.
double longest_step_of_flow(const StepState& state, const SolverSettings& solver,
                            const StepParameters& parameters, double smallest, double reach,
                            const TimeStepRule& rule = {});

/// A largest rate [1/s] strains the cell in a step by more than that; not by what rounding adds.
inline bool strains_too_far(double rate, double step, const TimeStepRule& rule = {}) {
  constexpr double rounding = 1e-12;
  return rate * step > (1 + rounding) * rule.longest_strain;
}

/// Time of a stage as a whole number of its shortest steps.
class StageClock {
 public:
  StageClock() = default;
  /// `end`: time of the stage [s], if it ends by time; the longest step is then shortened to a part of it.
  /// `begin`: time of the run then [s].
  StageClock(const TimeStepBounds& bounds, std::optional<double> end, double begin);

  /// The longest step that is at most `longest` [s], begins at a multiple of itself, and is at most twice the
  /// step before, from which the warm impulses come.
  void choose(double longest);
  void advance() { ticks_ += ticks_of(level_); }

  double step() const;  ///< chosen last [s]
  double time() const;  ///< of the run [s]
  /// Part of the time of the stage that is done; 0 where it has no end by time.
  double fraction() const { return last_ > 0 ? static_cast<double>(ticks_) / static_cast<double>(last_) : 0; }
  /// Gives the stage, which has begun, another end by time [s] or none. Steps keep their lengths, the last
  /// ones become shorter, and the stage ends beyond the end by less than the shortest of them.
  void move_end(std::optional<double> end);

  /// visit(name, member) for each member of a state, which may be const.
  template <class Clock, class Visit>
  static void each_number(Clock& clock, const Visit& visit) {
    visit("clock_begin", clock.begin_);
    visit("clock_longest", clock.longest_);
    visit("clock_levels", clock.levels_);
    visit("clock_level", clock.level_);
    visit("clock_ticks", clock.ticks_);
    visit("clock_last", clock.last_);
  }

 private:
  std::int64_t ticks_of(int level) const { return std::int64_t{1} << (levels_ - level); }

  double begin_ = 0;        ///< time of the run when the stage began [s]
  double longest_ = 0;      ///< [s]
  int levels_ = 0;          ///< the shortest step is the longest halved so many times
  int level_ = -1;          ///< of the step chosen last; -1: none yet
  std::int64_t ticks_ = 0;  ///< shortest steps done
  std::int64_t last_ = 0;   ///< shortest steps in the stage; 0: it does not end by time
};

}  // namespace talus
