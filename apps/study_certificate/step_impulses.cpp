#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "apps/study_certificate/step_problem.hpp"

namespace talus::audit {

StepLevers levers_of(const StepContact& contact) {
  if (contact.levers) return *contact.levers;
  StepLevers B;
  for (const Eigen::Index axis : {0, 1, 2}) B.first.col(axis) = contact.normal.cross(Vec3(Vec3::Unit(axis)));
  B.second = -B.first;
  return B;
}

void add_impulse(const StepProblem& problem, const StepContact& contact, const Vec3& r, Motion& motion) {
  const StepLevers B = levers_of(contact);
  if (!contact.is_moment()) motion.u[contact.first] += r / problem.mass[contact.first];
  motion.w[contact.first] += problem.spin_mobility[contact.first] * (B.first.transpose() * r);
  if (contact.at_wall()) {
    if (contact.is_moment()) return;
    const std::size_t w = contact.wall();
    const Vec3& n = problem.wall_normal[w];
    motion.walls[w] -= problem.wall_inv_mass[w] * r.dot(n) * n;
    return;
  }
  motion.w[contact.other()] -= problem.spin_mobility[contact.other()] * (B.second.transpose() * r);
  if (contact.is_moment()) return;
  motion.u[contact.other()] -= r / problem.mass[contact.other()];
  if (problem.cell.follows())
    motion.cell += problem.cell.mobility.cwiseProduct(push_on_cell(r, contact.branch));
}

Motion motion_under(const StepProblem& problem, std::span<const Vec3> impulses) {
  Motion motion = problem.free;
  for (std::size_t c = 0; c < impulses.size(); ++c)
    add_impulse(problem, problem.contacts[c], impulses[c], motion);
  return motion;
}

Vec3 relative_velocity(const StepContact& contact, const Motion& motion) {
  const std::size_t i = contact.first;
  const StepLevers B = levers_of(contact);
  Vec3 v = B.first * motion.w[i] - contact.drift;
  if (!contact.at_wall()) v -= B.second * motion.w[contact.other()];
  if (contact.is_moment()) return v;
  v += motion.u[i];
  if (contact.at_wall()) return v - motion.walls[contact.wall()];
  return v - motion.u[contact.other()] + stretched(motion.cell, contact.branch);
}

double speed_of_bodies(const StepProblem& problem, const StepContact& contact) {
  const Motion& free = problem.free;
  const double other = contact.at_wall() ? free.walls[contact.wall()].norm() + contact.drift.norm()
                                         : free.u[contact.other()].norm();
  return free.u[contact.first].norm() + other;
}

namespace {

using Pair = std::array<std::int64_t, 2>;  ///< ids, of a wall -(1 + its number); the larger first

/// Normals of one contact, in the frame's and in the problem's words, differ by less: 1 - cos.
constexpr double one_normal = 1e-9;

Pair pair_of(std::int64_t first, std::int64_t second) {
  return {std::max(first, second), std::min(first, second)};
}

/// How far the ball of a contact of clumps, which turns on from the middle of the step, ends from where force
/// `row` of the frame has it [m]: there a point lies in the middle of the gap that the step leaves.
double away_from(const StepProblem& problem, const StepContact& contact, const Frame& after,
                 std::size_t row) {
  if (problem.clumps.empty()) return 0;
  const std::size_t k = contact.first;
  const Mat3 on = rotation_of(after.orientation[k]) * problem.clumps[k].axes.transpose();
  const Vec3 centre = after.x[k] + on * contact.ball.centre;
  const double apart = contact.ball.radius + after.contact_gap[row] / 2;
  return (centre - after.contact_point[row] - apart * contact.normal).norm();
}

}  // namespace

RunImpulses impulses_of(const StepProblem& problem, const Frame& after) {
  RunImpulses all;
  std::map<Pair, std::vector<std::size_t>> between;
  std::vector<char> given(problem.contacts.size(), 0);
  for (std::size_t c = 0; c < problem.contacts.size(); ++c) {
    const StepContact& contact = problem.contacts[c];
    all.r.push_back(contact.pull * contact.normal);
    if (contact.is_moment()) continue;
    const std::int64_t id = after.id[contact.first];
    between[pair_of(id, contact.at_wall() ? contact.second : after.id[contact.other()])].push_back(c);
  }
  for (std::size_t k = 0; k < after.contact_bodies.size(); ++k) {
    const auto [a, b] = after.contact_bodies[k];
    std::size_t best = problem.contacts.size();
    double nearest = INFINITY;
    for (const std::size_t c : between[pair_of(a, b)]) {
      const StepContact& contact = problem.contacts[c];
      const double sign = after.id[contact.first] == a ? 1 : -1;
      const double away = away_from(problem, contact, after, k);
      if (given[c] || !(sign * after.contact_normal[k].dot(contact.normal) > 1 - one_normal)) continue;
      if (best == problem.contacts.size() || away < nearest) best = c, nearest = away;
    }
    if (best == problem.contacts.size()) {
      ++all.unknown;
      continue;
    }
    given[best] = 1;
    const double impulse_time = (after.id[problem.contacts[best].first] == a ? 1 : -1) * problem.time_step;
    all.r[best] += impulse_time * after.contact_force[k];
    if (best + 1 == problem.contacts.size() || after.contact_moment.empty()) continue;
    if (const StepContact& moment = problem.contacts[best + 1]; moment.is_moment())
      all.r[best + 1] = impulse_time / moment.rolls * after.contact_moment[k];
  }
  return all;
}

}  // namespace talus::audit
