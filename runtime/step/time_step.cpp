#include "runtime/step/time_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/detection/closing.hpp"
#include "runtime/step/cell_flow.hpp"

namespace talus {

namespace {

/// Most halvings of the longest step: more than any bound needs, and ticks fit 64 bits.
constexpr int most_levels = 30;

/// Bound on an overlap that a step makes before it can see it [m].
double unseen_overlap(const SolverSettings& solver, double smallest, const TimeStepRule& rule) {
  return rule.part_of_tolerance * std::min(solver.overlap_tolerance, 2 * rule.longest_way) * smallest;
}

double square(const double (&v)[3]) {
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

/// Largest speed of bodies here, without their spin, and of walls into the grains [m/s].
double fastest(const StepState& state) {
  double speed2 = 0;
  for (const Velocity& v : state.bodies.velocity) speed2 = std::max(speed2, square(v.u));
  double speed = std::sqrt(speed2);
  for (std::size_t w = 0; w < state.walls.size(); ++w)
    speed = std::max(speed, state.walls[w].motion.empty() ? state.walls[w].normal.dot(state.walls[w].velocity)
                                                          : state.wall_states[w].speed);
  return speed;
}

/// Acceleration by gravity, plus the largest of walls that oscillate [m/s^2].
double acceleration_of(const StepState& state, const StepParameters& parameters) {
  double walls = 0;
  for (const Wall& wall : state.walls) walls = std::max(walls, largest_acceleration(wall.motion));
  return parameters.gravity.norm() + walls;
}

/// Longest step that follows the oscillations of walls, infinity where none oscillates [s].
double shortest_time(const StepState& state, const TimeStepRule& rule) {
  double period = std::numeric_limits<double>::infinity();
  for (const Wall& wall : state.walls) period = std::min(period, shortest_period(wall.motion));
  return period / rule.steps_of_period;
}

double inverse(double rate) {
  return rate > 0 ? 1 / rate : std::numeric_limits<double>::infinity();
}

}  // namespace

TimeStepBounds time_step_bounds(const Stage& stage, const SolverSettings& solver, double smallest,
                                const TimeStepRule& rule) {
  TimeStepBounds bounds{stage.time_step_max, stage.time_step_min};
  // A shortest step that is asked for is one that overlaps have to bear.
  if (bounds.longest == 0)
    bounds.longest = std::max(bounds.shortest,
                              std::sqrt(2 * unseen_overlap(solver, smallest, rule) / stage.gravity.norm()));
  if (bounds.shortest == 0) bounds.shortest = bounds.longest / rule.range;
  return bounds;
}

double longest_time_step(const StepState& state, const Setup& setup, const StepParameters& parameters,
                         double smallest, const graph::Communicator& ranks, const TimeStepRule& rule) {
  const double unseen = unseen_overlap(setup.solver, smallest, rule);
  // A pair within the alert distance is a contact, which the step keeps from overlapping. So bodies that are
  // struck have that gap to use up, too, or half of it where both were struck; elastic pairs do not
  // (gap_law.hpp).
  const bool elastic = parameters.laws.largest(&PairLaw::restitution) >= 1;
  const double near = unseen + (elastic ? 0 : 0.5 * parameters.alert);
  const bool blind = !state.given_overlaps;  // before the first step any two may approach
  double rates[2] = {blind ? 0 : closing_rate(state.candidates, state.bodies, poses_of(state), near),
                     fastest(state)};
  ranks.max(rates);
  if (blind) rates[0] = 2 * rates[1] / near;
  return std::min({inverse(rates[0]), inverse(rates[1] / (rule.longest_way * smallest)),
                   std::sqrt(2 * unseen * inverse(acceleration_of(state, parameters))),
                   shortest_time(state, rule)});
}

double longest_step_of_flow(const StepState& state, const SolverSettings& solver,
                            const StepParameters& parameters, double smallest, double reach,
                            const TimeStepRule& rule) {
  if (!state.domain.repeats) return std::numeric_limits<double>::infinity();
  const Mat3& next = parameters.velocity_gradient;
  const Mat3 change =
      (state.cell.followed().array() > 0).select(Mat3::Zero(), next - gradient_before(state.domain, 0));
  const double unseen = unseen_overlap(solver, smallest, rule);
  return std::min(rule.longest_strain * inverse(next.cwiseAbs().maxCoeff()),
                  unseen * inverse(change.norm() * reach));
}

StageClock::StageClock(const TimeStepBounds& bounds, std::optional<double> end, double begin)
    : begin_(begin), longest_(bounds.longest) {
  double parts = 0;
  if (end) {
    // Rounding must not add a part.
    parts = std::max(1.0, std::ceil(*end / bounds.longest * (1 - 1e-12)));
    longest_ = *end / parts;
  }
  levels_ =
      std::clamp(static_cast<int>(std::floor(std::log2(longest_ / bounds.shortest) + 1e-9)), 0, most_levels);
  last_ = static_cast<std::int64_t>(parts) << levels_;
}

void StageClock::choose(double longest) {
  const int before = level_;
  level_ = before < 0 ? 0 : std::max(0, before - 1);
  while (level_ < levels_ && std::ldexp(longest_, -level_) > longest) ++level_;
  // At the last level every tick is a multiple.
  while (ticks_ % ticks_of(level_) != 0) ++level_;
  // An end that has been moved need not be one of them.
  while (last_ > 0 && level_ < levels_ && ticks_ + ticks_of(level_) > last_) ++level_;
}

void StageClock::move_end(std::optional<double> end) {
  const double tick = std::ldexp(longest_, -levels_);
  last_ =
      end ? std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(*end / tick * (1 - 1e-12)))) : 0;
}

double StageClock::step() const {
  return std::ldexp(longest_, -std::max(0, level_));
}

double StageClock::time() const {
  return begin_ + static_cast<double>(ticks_) * std::ldexp(longest_, -levels_);
}

}  // namespace talus
