#include "runtime/step/runaway.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace talus {

namespace {

std::string describe(const Bodies& bodies, Slot slot) {
  if (slot < 0) return "the fastest body is on another rank, or none has a speed that is a number";
  const auto s = static_cast<std::size_t>(slot);
  const Velocity& v = bodies.velocity[s];
  const Vec3& x = bodies.x[s];
  return fmt::format(
      "body {}: x = ({}, {}, {}) m, radius = {} m, u = ({}, {}, {}) m/s, R omega = ({}, {}, {}) m/s",
      static_cast<std::int64_t>(bodies.id[s]), x[0], x[1], x[2], bodies.radius[s], v.u[0], v.u[1], v.u[2],
      v.w[0], v.w[1], v.w[2]);
}

/// Walls do not collide with one another: two that face each other pass through each other if no grain
/// between them holds them.
void check_walls_apart(const std::vector<Wall>& walls, double facing, const StepName& step) {
  for (const Wall& moving : walls)
    for (const Wall& other : walls)
      if (!moving.absent && !other.absent &&
          (moving.load.drive != WallDrive::fixed || !moving.motion.empty()) &&
          (moving.normal + other.normal).norm() < facing &&
          (other.point - moving.point).dot(moving.normal) < 0)
        throw NoSpaceError(
            fmt::format("{}: wall '{}' has passed wall '{}', which faces it. Are there grains "
                        "between them? Reduce the load, the velocity or the time step",
                        step.text(), moving.name, other.name));
}

}  // namespace

double pressed_area(const StepState& state, std::size_t w, const StepName& step) {
  try {
    return face_area(state.walls, w, state.domain.edges());
  } catch (const std::invalid_argument&) {
    throw NoSpaceError(fmt::format(
        "{}: the walls beside wall '{}' have passed each other, so its "
        "pressure acts on nothing. Are there grains between them? Reduce the time step or the pressure",
        step.text(), state.walls[w].name));
  }
}

namespace {

/// A cell whose shear stress is more than its grains bear is sheared faster and faster.
void check_strain(const StepState& state, double time_step, double most, const StepName& step) {
  if (!state.cell.loaded()) return;
  // Of the edges in the middle of the step: those of its end may be all but gone.
  const double strain = time_step * gradient_before(state.domain, -time_step).cwiseAbs().maxCoeff();
  if (strain <= most) return;
  throw RunawayError(fmt::format(
      "{}: the stress strains the cell by {:.3g} in a step, more than {}. Reduce the time step, raise "
      "cell.inertia, or ask for a stress that the grains can bear: no more shear stress than "
      "friction holds, no more tension than cohesion does",
      step.text(), strain, most));
}

/// Rates that are given close a cell whatever its grains bear, and some begin too full. Balls of a clump may
/// overlap, and count whole: what room clumps need is not known.
void check_room(const StepOutcome& outcome) {
  const StepState& state = outcome.state;
  if (!state.domain.repeats || !outcome.setup.clumps.empty()) return;
  const double room = state.domain.volume(state.walls);  // 0 where nothing bounds it
  if (room == 0 || outcome.sample.volume <= room) return;
  const bool driven = !outcome.parameters.velocity_gradient.isZero(0);
  throw NoSpaceError(fmt::format("{}: the cell has {:.3g} m^3, less than its grains, {:.3g} m^3. {}",
                                 outcome.step.text(), room, outcome.sample.volume,
                                 driven ? "End the stage sooner, or let all of the cell follow a stress"
                                        : "Its grains overlap by far: make it larger"));
}

/// Energy of grains at the speed that attractions give one of mean size at a wall in a step [J]. It is no
/// load, but contacts that pull and push leave a part of it, by the tolerance.
double cohesive_energy(const StepOutcome& outcome) {
  const double mass = outcome.sample.total_mass;
  if (!(mass > 0)) return 0;
  const double speed = cohesive_impulse(outcome) * static_cast<double>(outcome.sample.bodies) / mass;
  return 0.5 * mass * speed * speed;
}

}  // namespace

void check_for_runaway(const StepOutcome& outcome, double energy_free, const RunawayThresholds& thresholds) {
  const auto& [step, setup, sample, parameters, state, sums, result] = outcome;
  const MotionSums& motion = sums.motion;
  if (result.diverged)
    throw RunawayError(
        fmt::format("{}: the iterations diverge, error {:.3g} after {} of them. {}", step.text(),
                    result.error_rms, result.iterations,
                    setup.decomposition.coupling == Coupling::schwarz && !setup.decomposition.damping
                        ? "Undamped Schwarz does so where bodies stand in more than two subdomains: set "
                          "decomposition.damping = true or coupling = \"nscdd\""
                        : "Reduce the time step, or look for masses too far apart"));
  if (std::isnan(motion.speed2_max) || !std::isfinite(motion.speed2_max) || std::isnan(result.error_rms))
    throw RunawayError(
        fmt::format("{}: the state is not finite; {}. Reduce the time step or look for overlapping "
                    "grains",
                    step.text(), describe(state.bodies, motion.fastest)));
  check_walls_apart(state.walls, thresholds.facing, step);
  check_strain(state, parameters.time_step, thresholds.most_strain, step);
  check_room(outcome);
  double fastest_wall2 = 0;
  for (std::size_t w = 0; w < state.walls.size(); ++w) {
    const double speed = state.wall_states[w].material_speed;
    fastest_wall2 = std::max({fastest_wall2, state.walls[w].load.velocity.squaredNorm(), speed * speed});
  }
  const double energy = motion.energy.translation + motion.energy.rotation;
  const double supplied =
      motion.energy_free + energy_free + sample.total_mass * fastest_wall2 + cohesive_energy(outcome);
  if (!result.converged && energy > thresholds.most_energy * supplied && energy > 0)
    throw RunawayError(
        fmt::format("{}: the kinetic energy rose to {} J where at most {} J were supplied; {}. "
                    "Reduce the time step or raise solver.max_iterations",
                    step.text(), energy, supplied, describe(state.bodies, motion.fastest)));
}

double free_energy_of(const StepState& state) {
  double energy = 0;
  for (const Wall& wall : state.walls)
    if (wall.load.pushed()) energy += 0.5 * wall.load.mass * (wall.velocity + wall.gain).squaredNorm();
  const StressedCell& cell = state.cell;
  const CellVelocity rates = components_of(state.flow.before);
  for (std::size_t k = 0; k < cell_freedoms && cell.loaded(); ++k) {
    const double velocity = cell.follows[k] ? cell.length * rates[k] + cell.push[k] / cell.mass : 0;
    energy += 0.5 * cell.mass * velocity * velocity;
  }
  return energy;
}

}  // namespace talus
