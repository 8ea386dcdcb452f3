#include "kernels/clusters/admissible.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/global/stiffness.hpp"
#include "kernels/law/friction_cone.hpp"

namespace talus {

namespace {

/// The problem without friction, from no impulses.
BodyProblem frictionless(const BodyProblem& problem) {
  BodyProblem smooth = problem;
  for (ContactEquation& c : smooth.contacts) c.mu = 0;
  smooth.impulse.assign(problem.contacts.size(), Vec3::Zero());
  return smooth;
}

/// What comes in and what drives, in the norm of M [J^(1/2)], and the mass [kg].
struct Incoming {
  double speed2 = 0, mass = 0;
};
Incoming coming_in(const BodyProblem& problem) {
  Incoming in;
  double kinetic = 0, fastest = 0;
  for (const BodyUnknown& body : problem.bodies) {
    in.mass += body.mass;
    kinetic += kinetic2(body, body.free.u, body.free.w);
  }
  for (const ContactEquation& c : problem.contacts)
    fastest = std::max(fastest, std::abs(c.normal.dot(c.offset)));
  in.speed2 = kinetic + in.mass * fastest * fastest;
  return in;
}

/// Impulses f = P_Kmu(-(v + b))/W_nn by which contacts still approach behind a step, without friction max(0,
/// -(v_n + b)) along the normals, and what they prove.
struct Approach {
  double sum = 0;    ///< of f [N s]
  double speed = 0;  ///< -sum f_n b_n / |H f|_M^-1 [J^(1/2)]
};
Approach approach_of(const BodyProblem& problem, const ProximalStep& step) {
  std::vector<Twist> momentum(problem.bodies.size());
  Approach left;
  double work = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const Vec3 approach = project_on_cone(Vec3(-step.velocity(k, step.motion)), c.normal, c.mu);
    if (!(c.normal.dot(approach) > 0)) continue;
    const Vec3 f = effective_mass(problem, c) * approach;
    left.sum += c.normal.dot(f);
    add_force(c, f, momentum);
    work -= c.normal.dot(c.offset) * c.normal.dot(f);
  }
  double norm2 = 0;
  for (std::size_t b = 0; b < momentum.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    restrict_to_freedoms(body, momentum[b]);
    norm2 += momentum[b].u.squaredNorm() / body.mass;
    if (body.spin_mass > 0) norm2 += momentum[b].w.squaredNorm() / body.spin_mass;
  }
  left.speed = work > 0 ? work / std::sqrt(norm2) : 0;
  return left;
}

bool closes_nothing(const ContactEquation& c) {
  return c.normal.dot(c.offset) >= 0;
}

/// No contact approaches, and what slides parts as well, where nothing moves.
bool rest_is_admissible(const BodyProblem& problem) {
  return std::ranges::all_of(problem.contacts, [](const ContactEquation& c) {
    return c.normal.dot(c.offset) >= c.mu * tangential(c, c.offset).norm();
  });
}

/// `problem`: with the cones of which the admissible velocities are the dual, and no impulses.
bool out_of_reach(const BodyProblem& problem, double enough, const AdmissibleThresholds& thresholds,
                  double& work) {
  if (rest_is_admissible(problem)) return false;
  const Incoming in = coming_in(problem);
  const double scale = std::sqrt(in.speed2), off = thresholds.inner * std::sqrt(in.mass) * scale;
  ProximalStep step(problem, thresholds.first_firmness);
  std::ranges::fill(step.shift, 0.0);
  double best = 0;
  for (int k = 0, since = 0; k < thresholds.most_steps && since < thresholds.patience && work > 0; ++k) {
    minimise({off, off}, thresholds.newton, step, work);
    const Approach left = approach_of(problem, step);
    if (!(left.sum > enough)) return false;
    if (left.speed > thresholds.beyond * scale) return true;
    const bool firm = step.firmness >= thresholds.last_firmness;  // soft springs tell little
    if (left.speed > thresholds.rise * best)
      since = 0;
    else if (firm)
      ++since;
    best = std::max(best, left.speed);
    for (std::size_t c = 0; c < problem.contacts.size(); ++c) step.centre[c] = step.carried(c, step.motion);
    step.firmness = std::min(thresholds.growth * step.firmness, thresholds.last_firmness);
  }
  return false;
}

}  // namespace

bool none_admissible(const BodyProblem& problem, double enough, const AdmissibleThresholds& thresholds,
                     double& work) {
  return out_of_reach(frictionless(problem), enough, thresholds, work);
}

bool friction_may_lock(const BodyProblem& problem, double enough, const AdmissibleThresholds& thresholds,
                       double& work) {
  // Walls that slide by, as belts do, press nothing.
  if (std::ranges::all_of(problem.contacts, closes_nothing)) return false;
  BodyProblem unloaded = problem;
  unloaded.impulse.assign(problem.contacts.size(), Vec3::Zero());
  return out_of_reach(unloaded, enough, thresholds, work);
}

}  // namespace talus
