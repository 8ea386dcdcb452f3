#include "runtime/step/named_bodies.hpp"

#include <algorithm>

#include "kernels/bodies/bodies.hpp"
#include "kernels/detection/separation.hpp"
#include "runtime/step/cell_flow.hpp"

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

/// The sum of whole edges of a cell, columns of `edges`, that is next to d [m].
Vec3 next_edges(const Mat3& edges, const Vec3& d) {
  Vec3 left = d;
  for (const Eigen::Index axis : {2, 1, 0})
    if (edges(axis, axis) > 0) left -= nearest_integer(left[axis] / edges(axis, axis)) * edges.col(axis);
  return d - left;
}

/// What the flow of a cell has given a body in a step, whatever its contacts did [m/s]: its gain in mid-step,
/// and where it was wrapped since `before`, the velocity of the image that goes on.
Vec3 gained_by_flow(const NamedBodies::Motion& before, const NamedState& now, const StepState& state,
                    const StepParameters& parameters) {
  if (!state.domain.repeats) return Vec3::Zero();
  const double half = 0.5 * parameters.time_step;
  const Mat3 edges = edges_of(state.domain) - half * matrix_of(state.domain.rates);
  const Vec3 unwrapped = before.x + half * before.u;
  // A correction of overlaps, which has moved the body since, is less than an edge.
  const Vec3 wrapped = next_edges(edges, unwrapped - (Vec3(now.x) - half * Vec3(now.u)));
  return (1 + parameters.reflection) * state.flow.gain.at(unwrapped - wrapped) - state.flow.before * wrapped;
}

}  // namespace

void NamedBodies::begin_step(std::span<const NamedBody> named, const StepState& state,
                             const graph::Communicator& ranks) {
  before_.clear();
  if (named.empty()) return;
  for (const NamedState& body : find_named(named, state, ranks))
    before_.push_back({Vec3(body.x), Vec3(body.u)});
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
    const Vec3 gained = report.u - before_[k].u - gained_by_flow(before_[k], body, state, parameters);
    report.force = body.mass * (gained / parameters.time_step - parameters.gravity);
    reports.push_back(std::move(report));
  }
  return reports;
}

}  // namespace talus
