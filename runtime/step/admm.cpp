#include "runtime/step/admm.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "kernels/balance.hpp"

namespace talus {

namespace {

/// Unknown of every slot, counted where a body is first met; empty when each body has one slot.
std::vector<Slot> number_bodies(const Bodies& bodies, const Decomposition& decomposition) {
  std::vector<Slot> unknown;
  if (!decomposition.several()) return unknown;
  std::unordered_map<std::int64_t, Slot> of_body;
  of_body.reserve(bodies.size());
  unknown.reserve(bodies.size());
  for (const BodyId id : bodies.id)
    unknown.push_back(
        of_body.try_emplace(static_cast<std::int64_t>(id), static_cast<Slot>(of_body.size())).first->second);
  return unknown;
}

double fastest_of(std::span<const Twist> velocity) {
  double fastest = 0;
  for (const Twist& v : velocity) fastest = std::max({fastest, v.u.norm(), v.w.norm()});
  return fastest;
}

}  // namespace

Admm::Admm(StepState& state, const StepParameters& parameters, const DecompositionSettings& decomposition,
           const graph::Communicator& ranks)
    : state_(state), parameters_(parameters), decomposition_(decomposition), ranks_(ranks) {}

BodyProblem Admm::gather() const {
  std::vector<WallMotion> walls;
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    walls.push_back(
        {state_.walls[w].normal, state_.wall_states[w].free_velocity, state_.walls[w].inv_mass()});
  const std::vector<Slot> unknown = number_bodies(state_.bodies, state_.decomposition);
  const bool split = decomposition_.coupling == Coupling::nscdd && state_.decomposition.several();
  return gather_problem({state_.bodies.x, state_.bodies.radius, state_.bodies.velocity, state_.free, walls,
                         state_.chunks, state_.contacts, parameters_.law.mu_grains, parameters_.law.mu_walls,
                         split ? Multiplicities(state_.decomposition.multiplicity) : Multiplicities(),
                         unknown});
}

double Admm::sweeps_needed() const {
  return estimate_stiffness(gather());
}

double Admm::velocity_error(double enough) const {
  return talus::velocity_error(gather(), enough).relative;
}

BodyAdmmResult Admm::improve(double tolerance, int calls) {
  BodyProblem problem = gather();
  BodyAdmmSettings settings;
  settings.tolerance = std::ldexp(settings.tolerance, -2 * calls);
  settings.balance_tolerance = std::ldexp(std::min(settings.balance_tolerance, 0.1 * tolerance), -2 * calls);
  // Contacts make nothing much faster than what comes in or than the gap that it closes, but what ADMM leaves
  // of a heavy body to light ones until sweeps follow.
  constexpr double sound = 1e6;
  double fastest = fastest_of(velocities_of(problem, problem.impulse));
  for (const BodyUnknown& body : problem.bodies) fastest = std::max(fastest, body.free.u.norm());
  for (const ContactEquation& contact : problem.contacts) fastest = std::max(fastest, contact.offset.norm());
  BodyAdmmResult result = solve_admm(problem, settings);
  // Masses too far apart for the digits of its linear system can carry it off: what it found then is dropped,
  // and the step is not balanced by it. Comparisons are false for NaN.
  if (result.momentum_defect <= 1 && fastest_of(velocities_of(problem, problem.impulse)) <= sound * fastest)
    scatter_impulses(problem, state_.contacts);
  else
    result.balance_defect = 1;
  if (!std::isfinite(result.balance_defect)) result.balance_defect = 1;  // too few iterations to know it
  return result;
}

}  // namespace talus
