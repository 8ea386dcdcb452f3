#include "runtime/step/cell_report.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "runtime/step/cell_flow.hpp"
#include "runtime/step/coordination.hpp"
#include "runtime/step/exact_sum.hpp"
#include "runtime/step/force_fabric.hpp"

namespace talus {

namespace {

/// xx, yy, zz, xy, xz, yz of the symmetric part.
std::array<double, 6> symmetric(const Mat3& m) {
  return {
      m(0, 0), m(1, 1), m(2, 2), (m(0, 1) + m(1, 0)) / 2, (m(0, 2) + m(2, 0)) / 2, (m(1, 2) + m(2, 1)) / 2};
}

/// A body that counts here: its velocity against the flow [m/s] and its mass [kg].
struct Moving {
  Vec3 v;
  double mass;
};
std::vector<Moving> against_flow(const StepState& state, const Mat3& gradient) {
  const Decomposition& all = state.decomposition;
  std::vector<Moving> bodies;
  for (std::size_t s = 0; s < state.bodies.size(); ++s) {
    if (!counts(all, s)) continue;
    const Velocity body = whole_velocity(all, state.bodies, s);
    if (body.inv_mass == 0) continue;
    bodies.push_back({Eigen::Map<const Vec3>(body.u) - gradient * (state.bodies.x[s] - state.domain.low),
                      1 / body.inv_mass});
  }
  return bodies;
}

/// The sums over the rows of all ranks, none of whose numbers is beyond `largest`: the same in any order, as
/// a run begins before its bodies are dealt out to subdomains.
template <std::size_t N>
std::vector<double> sums_over(std::span<const std::array<double, N>> rows, double largest,
                              const graph::Communicator& ranks) {
  std::vector<ExactSum> sums(N, ExactSum(largest));
  for (const std::array<double, N>& row : rows)
    for (std::size_t k = 0; k < N; ++k) sums[k].add(row[k]);
  return all_over(sums, ranks);
}

/// The mean of the velocities, by mass [m/s]. Collective.
Vec3 mean_of(const std::vector<Moving>& bodies, const graph::Communicator& ranks) {
  double most[2] = {0, 0};  // component, mass
  for (const auto& [v, mass] : bodies) {
    most[0] = std::max(most[0], v.cwiseAbs().maxCoeff());
    most[1] = std::max(most[1], mass);
  }
  ranks.max(most);
  const auto& [fastest, heaviest] = most;
  std::vector<std::array<double, 4>> rows;
  rows.reserve(bodies.size());
  for (const auto& [v, mass] : bodies)
    rows.push_back({mass * v[0], mass * v[1], mass * v[2], mass * fastest});
  const std::vector<double> sum = sums_over<4>(rows, heaviest * fastest, ranks);
  return sum[3] > 0 ? Vec3(fastest / sum[3] * Vec3(sum.data())) : Vec3(Vec3::Zero());
}

}  // namespace

Mat3 kinetic_moment(const StepState& state, const Mat3& gradient, const graph::Communicator& ranks) {
  const std::vector<Moving> bodies = against_flow(state, gradient);
  const Vec3 mean = mean_of(bodies, ranks);
  std::vector<std::array<double, 6>> rows;
  rows.reserve(bodies.size());
  double largest[1] = {0};
  for (const auto& [whole, mass] : bodies) {
    const Vec3 v = whole - mean, p = mass * v;
    rows.push_back({p[0] * v[0], p[1] * v[1], p[2] * v[2], p[0] * v[1], p[0] * v[2], p[1] * v[2]});
    largest[0] = std::max(largest[0], p.dot(v));
  }
  ranks.max(largest);
  const std::vector<double> sum = sums_over<6>(rows, largest[0], ranks);
  Mat3 moment;
  moment << sum[0], sum[3], sum[4], sum[3], sum[1], sum[5], sum[4], sum[5], sum[2];
  return moment;
}

double stress_ratio(const Mat3& stress) {
  const double q = std::sqrt(1.5) * deviator(stress).norm();
  return q == 0 ? 0 : q / (stress.trace() / 3);
}

double inertial_time(const SampleSize& size, double p) {
  const double density = size.volume > 0 ? size.total_mass / size.volume : 0;
  return p > 0 ? size.mean_diameter * std::sqrt(density / p) : 0;
}

std::optional<CellReport> cell_report(const StepOutcome& outcome, const StepReport& report,
                                      const graph::Communicator& ranks) {
  const StepState& state = outcome.state;
  const double volume = state.domain.volume(state.walls);
  if (!state.domain.repeats || !(volume > 0)) return std::nullopt;
  CellReport out;
  out.step = report.step;
  out.time = report.time;
  out.stage = outcome.step.stage;
  const PeriodicSpace& cell = state.domain.cell;
  out.edges = {cell.xx, cell.yy, cell.zz, cell.xy, cell.xz, cell.yz};
  const Mat3 gradient = gradient_before(state.domain, 0);
  const Mat3 contact = outcome.sums.contacts.moment / (volume * outcome.parameters.impulse_time()),
             kinetic =
                 (report.kinetic_moment ? *report.kinetic_moment : kinetic_moment(state, gradient, ranks)) /
                 volume;
  out.stress = symmetric(contact);
  out.kinetic_stress = symmetric(kinetic);
  out.p = contact.trace() / 3;
  out.q = std::sqrt(1.5) * deviator(contact).norm();
  out.q_over_p = stress_ratio(contact);
  out.solid_fraction = report.solid_fraction;
  out.contacts_a_grain = 2 * static_cast<double>(report.active) /
                         static_cast<double>(std::max<std::int64_t>(1, outcome.sample.bodies));
  const ForceFabric fabric = force_fabric(state, ranks);
  out.fabric = symmetric(fabric.fabric);
  out.a_c = along_stress(fabric.of_contacts, deviator(contact));
  out.a_n = along_stress(fabric.of_normal_forces, deviator(contact));
  out.a_t = along_stress(fabric.of_tangential_forces, deviator(contact));
  out.fabric_q_over_p = stress_ratio_of(fabric, deviator(contact));
  out.coordination = coordination(state, ranks, contacts_to_hold(outcome.parameters));
  // Of a flow that nothing presses together it is infinite.
  const double rate = shear_rate(gradient);
  out.inertial_number = rate > 0 && out.p <= 0 ? std::numeric_limits<double>::infinity()
                                               : rate * inertial_time(outcome.sample, out.p);
  out.converged = report.converged;
  return out;
}

}  // namespace talus
