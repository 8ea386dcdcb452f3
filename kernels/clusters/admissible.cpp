#include "kernels/clusters/admissible.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/global/stiffness.hpp"

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

/// Impulses f = max(0, -(v_n + b))/W_nn by which contacts still approach behind a step, and what they prove.
struct Approach {
  double sum = 0;    ///< of f [N s]
  double speed = 0;  ///< -f.b / |H f|_M^-1 [J^(1/2)]
};
Approach approach_of(const BodyProblem& problem, const ProximalStep& step) {
  std::vector<Twist> momentum(problem.bodies.size());
  Approach left;
  double work = 0;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const ContactEquation& c = problem.contacts[k];
    const double approach = -c.normal.dot(step.velocity(k, step.motion));
    if (!(approach > 0)) continue;
    const double f = effective_mass(problem, c) * approach;
    left.sum += f;
    add_force(c, Vec3(f * c.normal), momentum);
    work -= c.offset.dot(f * c.normal);
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

/// No contact approaches where nothing moves.
bool rest_is_admissible(const BodyProblem& problem) {
  return std::ranges::all_of(problem.contacts,
                             [](const ContactEquation& c) { return c.normal.dot(c.offset) >= 0; });
}

}  // namespace

bool none_admissible(const BodyProblem& problem, double enough, const AdmissibleThresholds& thresholds,
                     double& work) {
  if (rest_is_admissible(problem)) return false;
  const BodyProblem smooth = frictionless(problem);
  const Incoming in = coming_in(smooth);
  const double scale = std::sqrt(in.speed2), off = thresholds.inner * std::sqrt(in.mass) * scale;
  ProximalStep step(smooth, thresholds.first_firmness);
  double best = 0;
  for (int k = 0, since = 0; k < thresholds.most_steps && since < thresholds.patience && work > 0; ++k) {
    minimise({off, off}, thresholds.newton, step, work);
    const Approach left = approach_of(smooth, step);
    if (!(left.sum > enough)) return false;
    if (left.speed > thresholds.beyond * scale) return true;
    const bool firm = step.firmness >= thresholds.last_firmness;  // soft springs tell little
    if (left.speed > thresholds.rise * best)
      since = 0;
    else if (firm)
      ++since;
    best = std::max(best, left.speed);
    for (std::size_t c = 0; c < smooth.contacts.size(); ++c) step.centre[c] = step.carried(c, step.motion);
    step.firmness = std::min(thresholds.growth * step.firmness, thresholds.last_firmness);
  }
  return false;
}

}  // namespace talus
