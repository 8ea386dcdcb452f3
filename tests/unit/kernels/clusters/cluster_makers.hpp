#pragma once

/// Small problems over bodies with closed forms, for the tests of clusters: grains of 1 kg that a step's
/// gravity pulls down.

#include <cmath>
#include <cstdint>

#include "kernels/clusters/correction.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus::cluster_makers {

constexpr double fall = 9.81e-3;        ///< g h [m/s]
constexpr double enough = 1e-4 * fall;  ///< momentum that need not be told apart [N s]

/// Impulse of contact k, corrected [N s].
inline Vec3 impulse_of(const BodyProblem& problem, const Correction& correction, std::size_t k) {
  return problem.impulse[k] + correction.impulse[k];
}

inline std::int32_t add_grain(BodyProblem& problem, const Vec3& x, double mu) {
  BodyUnknown body;
  body.mass = 1;
  body.spin_mass = mu > 0 ? 0.4 : 0;
  body.radius = 0.01;
  body.x = x;
  body.free.u = Vec3(0, 0, -fall);
  problem.bodies.push_back(body);
  problem.grains = problem.bodies.size();
  return static_cast<std::int32_t>(problem.grains) - 1;
}

/// `wall`: its number, where `second` is -1.
inline void add_contact(BodyProblem& problem, std::int32_t first, std::int32_t second, const Vec3& normal,
                        double mu, std::int32_t wall = -1) {
  ContactEquation contact;
  contact.normal = normal;
  contact.offset = Vec3::Zero();
  contact.mu = mu;
  contact.first = first;
  contact.second = second;
  contact.wall = wall;
  problem.contacts.push_back(contact);
  problem.impulse.push_back(Vec3::Zero());
}

/// A grain in a V of half angle `a`: each wall carries m g h/(2 sin a).
inline BodyProblem wedge(double a, double mu) {
  BodyProblem problem;
  const std::int32_t grain = add_grain(problem, Vec3::Zero(), mu);
  add_contact(problem, grain, -1, Vec3(std::cos(a), 0, std::sin(a)), mu, 0);
  add_contact(problem, grain, -1, Vec3(-std::cos(a), 0, std::sin(a)), mu, 1);
  return problem;
}

}  // namespace talus::cluster_makers
