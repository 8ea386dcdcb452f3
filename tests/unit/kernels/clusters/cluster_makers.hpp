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

/// Two grains of 1 kg, each on a plane that leans by the sine `lean`, under a lid that comes down with 1 N s
/// and is heavy or light. A grain that carries P gives way by P lean^2. Grain b is `gap` [m/s] further from
/// the lid, so that P_a - P_b = gap/lean^2. The impulses leave all to grain a, and `excess` more.
inline BodyProblem under_a_lid(double lean, double gap, double lid_mass, double excess) {
  BodyProblem problem;
  const Vec3 plane(lean, 0, std::sqrt(1 - lean * lean));
  for (std::int32_t k = 0; k < 2; ++k) {
    add_grain(problem, k * Vec3::UnitX(), 0);
    problem.bodies.back().free.u = Vec3::Zero();
  }
  BodyUnknown lid;
  lid.mass = lid_mass;
  lid.kind = BodyKind::wall;
  lid.axis = -Vec3::UnitZ();
  lid.free.u = -Vec3::UnitZ() / lid_mass;
  problem.bodies.push_back(lid);
  for (std::int32_t k = 0; k < 2; ++k) add_contact(problem, k, -1, plane, 0, 0);
  for (std::int32_t k = 0; k < 2; ++k) add_contact(problem, k, 2, -Vec3::UnitZ(), 0, 1);
  problem.contacts[3].offset = -gap * Vec3::UnitZ();
  const double carried = 1 + excess;
  problem.impulse[0] = carried * plane.z() * plane;
  problem.impulse[2] = -carried * Vec3::UnitZ();
  return problem;
}

}  // namespace talus::cluster_makers
