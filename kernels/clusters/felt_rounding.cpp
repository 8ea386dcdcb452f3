#include "kernels/clusters/felt_rounding.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "kernels/bodies/larger.hpp"

namespace talus {

namespace {

/// Which way gaps are changed, those of even and of odd contacts: all wider, all narrower, and by turns.
constexpr std::array<std::array<double, 2>, 4> signs{{{1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};

double momentum_of(const BodyUnknown& body, const Twist& V) {
  return body.mass * V.u.norm() + body.spin_mass * V.w.norm();
}

}  // namespace

bool lopsided(const BodyProblem& problem, double times) {
  double lightest = std::numeric_limits<double>::infinity(), heaviest = 0;
  for (const BodyUnknown& body : problem.bodies) {
    lightest = std::min(lightest, body.mass);
    heaviest = std::max(heaviest, body.mass);
  }
  return heaviest > times * lightest;
}

double FeltRounding::all_momentum() const {
  return std::accumulate(momentum.begin(), momentum.end(), 0.0);
}

double FeltRounding::beyond(std::size_t contact, double change) const {
  return impulse.empty() ? change : larger(0.0, change - impulse[contact]);
}

double FeltRounding::part_of_motion(const BodyProblem& problem, const std::vector<Twist>& motion) const {
  double part = 0;
  for (std::size_t b = 0; b < momentum.size(); ++b)
    part += std::min(momentum[b], momentum_of(problem.bodies[b], motion[b]));
  return part;
}

FeltRounding felt_rounding(const BodyProblem& problem, const ClusterGoal& goal,
                           const ClusterThresholds& thresholds) {
  const double all = mass_of(problem);
  FeltRounding felt{std::vector<double>(problem.bodies.size(), 0.0),
                    std::vector<double>(problem.contacts.size(), 0.0)};
  const ClusterAnswer answer = solve_cluster(problem, goal, thresholds);
  if (!answer.solved()) return felt;
  BodyProblem solved = problem;
  for (std::size_t k = 0; k < solved.contacts.size(); ++k) {
    solved.impulse[k] += answer.impulse[k];
    if (!answer.moment.empty()) solved.rolling[k].moment += answer.moment[k];
  }
  for (const auto& sign : signs) {
    BodyProblem other = solved;
    for (std::size_t k = 0; k < other.contacts.size(); ++k)
      other.contacts[k].offset += sign[k % 2] * goal.still * other.contacts[k].normal;
    const ClusterAnswer changed = solve_cluster(other, goal, thresholds);
    if (!changed.solved()) continue;
    // A nearly straight chain is moved by thousands of times what its gaps change by, which is no rounding.
    for (std::size_t b = 0; b < felt.momentum.size(); ++b) {
      const BodyUnknown& body = problem.bodies[b];
      const double moved = std::min(momentum_of(body, changed.motion[b]), body.mass * goal.still);
      felt.momentum[b] = std::max(felt.momentum[b], moved);
    }
    for (std::size_t k = 0; k < felt.impulse.size(); ++k)
      felt.impulse[k] = std::max(felt.impulse[k], std::min(changed.found[k].norm(), all * goal.still));
  }
  return felt;
}

}  // namespace talus
