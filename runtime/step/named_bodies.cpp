#include "runtime/step/named_bodies.hpp"

#include <algorithm>

#include "kernels/bodies/bodies.hpp"

namespace talus {

namespace {

/// State of a named body, and whether it is on this rank.
struct NamedState {
  double there = 0, x[3]{}, u[3]{}, w[3]{}, radius = 0, mass = 0;
};

std::vector<NamedState> find_named(std::span<const NamedBody> named, const StepState& state,
                                   const graph::Communicator& ranks) {
  std::vector<NamedState> found(named.size());
  const Bodies& bodies = state.bodies;
  for (std::size_t s = 0; s < bodies.size(); ++s) {
    const auto which = std::ranges::find(named, bodies.id[s], &NamedBody::id);
    if (which == named.end() || !counts(state.decomposition, s)) continue;
    NamedState& to = found[static_cast<std::size_t>(which - named.begin())];
    const Velocity v = whole_velocity(state.decomposition, bodies, s);
    to.there = 1;
    std::copy_n(bodies.x[s].data(), 3, to.x);
    std::copy_n(v.u, 3, to.u);
    std::copy_n(v.w, 3, to.w);
    to.radius = bodies.radius[s];
    to.mass = v.inv_mass > 0 ? 1 / v.inv_mass : 0;
  }
  if (ranks.ranks() == 1) return found;
  // Rows of all ranks: `there` marks the one from the rank that has the body.
  const auto rows = ranks.gather_records(std::span<const NamedState>(found));
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (rows[k].there > 0) found[k % named.size()] = rows[k];
  return found;
}

}  // namespace

void NamedBodies::begin_step(std::span<const NamedBody> named, const StepState& state,
                             const graph::Communicator& ranks) {
  before_.clear();
  if (named.empty()) return;
  for (const NamedState& body : find_named(named, state, ranks))
    before_.emplace_back(body.u[0], body.u[1], body.u[2]);
}

std::vector<BodyReport> NamedBodies::end_step(std::span<const NamedBody> named, const StepState& state,
                                              const StepParameters& parameters,
                                              const graph::Communicator& ranks) const {
  std::vector<BodyReport> reports;
  if (named.empty()) return reports;
  const std::vector<NamedState> now = find_named(named, state, ranks);
  for (std::size_t k = 0; k < named.size(); ++k) {
    const NamedState& body = now[k];
    if (body.there == 0) continue;
    BodyReport report{named[k].name, Vec3(body.x), Vec3(body.u), Vec3(body.w) / body.radius};
    report.force = body.mass * ((report.u - before_[k]) / parameters.time_step - parameters.gravity);
    reports.push_back(std::move(report));
  }
  return reports;
}

}  // namespace talus
