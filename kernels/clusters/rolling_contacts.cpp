#include "kernels/clusters/rolling_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

/// I [kg m^2]; 0 of what does not turn.
double inertia(const BodyUnknown& body) {
  return body.kind == BodyKind::wall ? 0 : body.spin_mass * body.radius * body.radius;
}
/// The second body of a contact is missing at a driven wall.
bool turns(const BodyProblem& problem, std::int32_t body) {
  return body >= 0 && inertia(problem.bodies[at(body)]) > 0;
}

}  // namespace

bool rolls(const BodyProblem& problem, std::size_t k) {
  const ContactEquation& c = problem.contacts[k];
  return !problem.rolling.empty() && problem.rolling[k].arm > 0 &&
         (turns(problem, c.first) || turns(problem, c.second));
}

Vec3 rolling_rate(const BodyProblem& problem, std::size_t k, std::span<const Twist> V) {
  const ContactEquation& c = problem.contacts[k];
  Vec3 rate = Vec3::Zero();
  if (turns(problem, c.first)) rate += V[at(c.first)].w / problem.bodies[at(c.first)].radius;
  if (turns(problem, c.second)) rate -= V[at(c.second)].w / problem.bodies[at(c.second)].radius;
  return tangential(c, rate);
}

Vec3 rolling_rate_at(const BodyProblem& problem, std::size_t k, std::span<const Twist> V) {
  return rolling_rate(problem, k, V) - tangential(problem.contacts[k], problem.rolling[k].spin);
}

Rolling rolling_at(const BodyProblem& problem, std::size_t k, const Vec3& rate, const Vec3& impulse) {
  const double r_n = std::max(0.0, problem.contacts[k].normal.dot(impulse));
  return {rate, rolling_mobility(problem, k), problem.rolling[k].arm * r_n};
}

double wrong_moment(const BodyProblem& problem, std::size_t k, const Vec3& m, const Rolling& contact) {
  return (m - solve_rolling(m, contact)).norm() / rolling_lever(problem, k);
}

bool has_rolling(const BodyProblem& problem) {
  for (std::size_t k = 0; k < problem.rolling.size(); ++k)
    if (rolls(problem, k)) return true;
  return false;
}

std::array<Twist, 2> push_of_moment(const BodyProblem& problem, std::size_t k, const Vec3& m) {
  const ContactEquation& c = problem.contacts[k];
  std::array<Twist, 2> push{};
  if (turns(problem, c.first)) push[0].w = m / problem.bodies[at(c.first)].radius;
  if (turns(problem, c.second)) push[1].w = -m / problem.bodies[at(c.second)].radius;
  return push;
}

void add_moment(const BodyProblem& problem, std::size_t k, const Vec3& m, std::span<Twist> F) {
  const ContactEquation& c = problem.contacts[k];
  const auto [first, second] = push_of_moment(problem, k, m);
  F[at(c.first)].w += first.w;
  if (c.second >= 0) F[at(c.second)].w += second.w;
}

double rolling_mobility(const BodyProblem& problem, std::size_t k) {
  double mobility = 0;
  for (const std::int32_t body : {problem.contacts[k].first, problem.contacts[k].second})
    if (turns(problem, body)) mobility += 1 / inertia(problem.bodies[at(body)]);
  return mobility;
}

double rolling_lever(const BodyProblem& problem, std::size_t k) {
  const auto [first, second] = std::pair(problem.contacts[k].first, problem.contacts[k].second);
  const double radius = problem.bodies[at(first)].radius;
  return turns(problem, second) ? std::min(radius, problem.bodies[at(second)].radius) : radius;
}

double rolling_residual2(const BodyProblem& problem, std::span<const Vec3> impulse,
                         std::span<const Twist> V) {
  double sum = 0;
  for (std::size_t k = 0; k < problem.rolling.size(); ++k) {
    if (!rolls(problem, k)) continue;
    const Vec3& m = problem.rolling[k].moment;
    const Rolling contact = rolling_at(problem, k, rolling_rate_at(problem, k, V), impulse[k]);
    sum += (m - solve_rolling(m, contact)).squaredNorm() * contact.mobility;
  }
  return sum;
}

std::vector<Twist> free_of_attraction(const BodyProblem& problem) {
  std::vector<Twist> force;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const bool rolling = rolls(problem, k);
    if (c.pull == 0 && !rolling) continue;
    force.resize(problem.bodies.size());
    if (c.pull > 0) add_force(c, -c.pull * c.normal, force);
    if (rolling) add_moment(problem, k, problem.rolling[k].moment, force);
  }
  std::vector<Twist> free;
  for (const BodyUnknown& body : problem.bodies) free.push_back(body.free);
  for (std::size_t b = 0; b < force.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    restrict_to_freedoms(body, force[b]);
    free[b].u -= force[b].u / body.mass;
    if (body.spin_mass > 0) free[b].w -= force[b].w / body.spin_mass;
  }
  return free;
}

BodyProblem with_moments(const BodyProblem& problem, std::span<const Vec3> change) {
  BodyProblem other = problem;
  std::vector<Twist> force(problem.bodies.size());
  for (std::size_t k = 0; k < change.size(); ++k) {
    if (!rolls(problem, k)) continue;
    add_moment(problem, k, change[k], force);
    other.rolling[k].moment += change[k];
  }
  for (std::size_t b = 0; b < force.size(); ++b)
    if (other.bodies[b].spin_mass > 0 && other.bodies[b].kind != BodyKind::cell)
      other.bodies[b].free.w += force[b].w / other.bodies[b].spin_mass;
  return other;
}

Vec3 admissible_change(const BodyProblem& problem, std::size_t k, const Vec3& impulse, const Vec3& change) {
  const auto& [arm, spin, before] = problem.rolling[k];
  const double r_n = std::max(0.0, problem.contacts[k].normal.dot(impulse));
  return admissible_moment(before + change, arm * r_n) - before;
}

RollingSet::RollingSet(const BodyProblem& problem, std::span<const Twist> V) : problem_(&problem) {
  if (problem.rolling.empty()) return;
  const std::size_t n = problem.contacts.size();
  state_.assign(n, State::none);
  rate_.assign(n, Vec3::Zero());
  known_ = across_ = change_ = rate_;
  for (std::size_t k = 0; k < n; ++k)
    if (rolls(problem, k)) rate_[k] = rolling_rate_at(problem, k, V);
}

/// m = L d with d = aim/|aim| and aim = m - w/mobility turns, with w, by L/(|aim| - L) dw/mobility across d:
/// what held and what is at its bound pass into one another.
double RollingSet::see(double firmness, std::span<const Twist> motion, std::span<const Vec3> carried) {
  double wrong = 0;
  for (std::size_t k = 0; k < state_.size(); ++k) {
    if (!rolls(*problem_, k)) continue;
    const Vec3 &before = problem_->rolling[k].moment, m = before + change_[k];
    const Rolling contact =
        rolling_at(*problem_, k, rate_[k] + rolling_rate(*problem_, k, motion), carried[k]);
    const Vec3 aim = m - contact.rate / contact.mobility, right = admissible_moment(aim, contact.most);
    wrong += wrong_moment(*problem_, k, m, contact);
    state_[k] = contact.most == 0 ? State::none : right == aim ? State::held : State::bound;
    if (held(k)) continue;
    known_[k] = right - before;
    across_[k].setZero();
    if (state_[k] == State::none) continue;
    const double beyond = aim.norm() - contact.most;
    const double stiffness = std::min(contact.most / beyond, firmness) / contact.mobility;
    across_[k] = std::sqrt(stiffness) * problem_->contacts[k].normal.cross(right.normalized());
    known_[k] += across_[k].dot(rolling_rate(*problem_, k, motion)) * across_[k];
  }
  return wrong;
}

void RollingSet::add_springs(std::size_t k, std::size_t number, double firmness,
                             std::vector<MomentSpring>& to) const {
  if (state_.empty() || state_[k] == State::none) return;
  if (state_[k] == State::bound) {
    to.push_back({number, across_[k], 1});
    return;
  }
  // The columns of 1 - n n^T: together they resist what turns in the tangent plane.
  for (int axis = 0; axis < 3; ++axis)
    to.push_back({number, tangential(problem_->contacts[k], Vec3::Unit(axis)),
                  firmness / rolling_mobility(*problem_, k)});
}

void RollingSet::add_force(double firmness, std::span<Twist> F) const {
  for (std::size_t k = 0; k < state_.size(); ++k) {
    if (!rolls(*problem_, k)) continue;
    const Vec3 m =
        held(k) ? Vec3(change_[k] - firmness / rolling_mobility(*problem_, k) * rate_[k]) : known_[k];
    add_moment(*problem_, k, m, F);
  }
}

double RollingSet::take_multipliers(double firmness, std::span<const Twist> motion) {
  double missed = 0;
  for (std::size_t k = 0; k < state_.size(); ++k) {
    if (!rolls(*problem_, k)) continue;
    if (!held(k)) {
      change_[k] = known_[k] - across_[k].dot(rolling_rate(*problem_, k, motion)) * across_[k];
      continue;
    }
    const double inertia = 1 / rolling_mobility(*problem_, k);
    const Vec3 rest = -rate_[k] - rolling_rate(*problem_, k, motion);
    change_[k] += firmness * inertia * rest;
    missed += inertia * rest.norm() / rolling_lever(*problem_, k);
  }
  return missed;
}

}  // namespace talus
