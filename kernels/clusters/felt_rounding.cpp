#include "kernels/clusters/felt_rounding.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>

namespace talus {

namespace {

/// Gaps are changed up or down by patterns that no sum along a chain makes nothing of: all alike, by turns,
/// and by the number of ones in the contact's own.
constexpr int patterns = 3;

double sign_of(int pattern, std::size_t contact) {
  const auto number = static_cast<std::uint64_t>(contact);
  const int ones = pattern == 0 ? 0 : pattern == 1 ? static_cast<int>(number & 1U) : std::popcount(number);
  return ones % 2 == 0 ? 1 : -1;
}

double momentum_of(const BodyUnknown& body, const Twist& V) {
  return body.mass * V.u.norm() + body.spin_mass * V.w.norm();
}

}  // namespace

double FeltRounding::all_momentum() const {
  return std::accumulate(momentum.begin(), momentum.end(), 0.0);
}

double FeltRounding::beyond(std::size_t contact, double change) const {
  return impulse.empty() ? change : std::max(0.0, change - impulse[contact]);
}

double FeltRounding::part_of_motion(const BodyProblem& problem, const std::vector<Twist>& motion) const {
  double part = 0;
  for (std::size_t b = 0; b < momentum.size(); ++b)
    part += std::min(momentum[b], momentum_of(problem.bodies[b], motion[b]));
  return part;
}

FeltRounding felt_rounding(const BodyProblem& problem, const ClusterGoal& goal,
                           const ClusterThresholds& thresholds) {
  FeltRounding felt{std::vector<double>(problem.bodies.size(), 0.0),
                    std::vector<double>(problem.contacts.size(), 0.0)};
  const ClusterAnswer answer = solve_cluster(problem, goal, thresholds);
  if (!answer.solved) return felt;
  BodyProblem solved = problem;
  for (std::size_t k = 0; k < solved.contacts.size(); ++k) {
    solved.impulse[k] += answer.impulse[k];
    if (!answer.moment.empty()) solved.rolling[k].moment += answer.moment[k];
  }
  for (int pattern = 0; pattern < patterns; ++pattern) {
    BodyProblem other = solved;
    for (std::size_t k = 0; k < other.contacts.size(); ++k)
      other.contacts[k].offset += sign_of(pattern, k) * goal.still * other.contacts[k].normal;
    const ClusterAnswer changed = solve_cluster(other, goal, thresholds);
    if (!changed.solved) continue;
    for (std::size_t b = 0; b < felt.momentum.size(); ++b)
      felt.momentum[b] = std::max(felt.momentum[b], momentum_of(problem.bodies[b], changed.motion[b]));
    for (std::size_t k = 0; k < felt.impulse.size(); ++k)
      felt.impulse[k] = std::max(felt.impulse[k], changed.found[k].norm());
  }
  return felt;
}

}  // namespace talus
