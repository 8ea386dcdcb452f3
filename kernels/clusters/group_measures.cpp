#include "kernels/clusters/group_measures.hpp"

#include <algorithm>
#include <vector>

#include "kernels/bodies/index.hpp"

namespace talus {

Vec3 face_shares(const BodyProblem& problem, const ContactEquation& c, const Vec3& faces) {
  if (c.wall >= 0 || c.second < 0) return Vec3::Zero();
  if (c.cell >= 0) return faces.cwiseProduct(c.branch);
  const double between = problem.bodies[at(c.first)].radius + problem.bodies[at(c.second)].radius;
  return faces.cwiseProduct(between * c.normal);
}

Measures measures_of(const BodyProblem& problem, const Vec3& faces) {
  Measures row{};
  // What pulls as hard as it presses does nothing, and must not hide what is wrong.
  const std::vector<Twist> free = free_of_attraction(problem),
                           done = added(velocities_of(problem, problem.impulse), -1, free);
  for (std::size_t b = 0; b < problem.bodies.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    row[MeasureColumn::mass] += body.mass;
    row[MeasureColumn::incoming] += kinetic2(body, free[b].u, free[b].w);
    row[MeasureColumn::gained] += body.mass * done[b].u.norm() + body.spin_mass * done[b].w.norm();
    if (body.kind != BodyKind::grain) continue;
    row[MeasureColumn::grains] += body.mass;
    row[MeasureColumn::energy] += 0.5 * body.mass * done[b].u.squaredNorm();
  }
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3& r = problem.impulse[k];
    row[MeasureColumn::fastest] = larger(row[MeasureColumn::fastest], c.offset.norm());
    row[MeasureColumn::largest] = larger(row[MeasureColumn::largest], r.norm());
    row[MeasureColumn::pulls] += c.pull;
    const double felt = std::abs(c.normal.dot(r) - c.pull);
    if (c.wall >= 0) row[MeasureColumn::pressed] += felt;
    row[MeasureColumn::pressed] += face_shares(problem, c, faces).norm() * felt;
    if (r != Vec3::Zero()) row[MeasureColumn::drive] = larger(row[MeasureColumn::drive], c.drive);
  }
  return row;
}

double scale_of(const Measures& row, const StepErrorThresholds& thresholds) {
  const MomentumSums sums{.mass = row[MeasureColumn::mass],
                          .incoming = row[MeasureColumn::incoming],
                          .exchanged = row[MeasureColumn::gained],
                          .fastest = row[MeasureColumn::fastest],
                          .drive = row[MeasureColumn::drive],
                          .at_rest = thresholds.pressed * row[MeasureColumn::pressed]};
  return std::max(momentum_scale(sums, thresholds.rounding), thresholds.held * row[MeasureColumn::pulls]);
}

}  // namespace talus
