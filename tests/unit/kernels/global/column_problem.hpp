#pragma once

// A column of spheres as a problem over bodies, and how wrong its impulses are.

#include <algorithm>

#include "kernels/global/body_problem.hpp"

namespace talus::test {

inline constexpr double gravity = 9.81;

/// Units of mass, length and time against SI: answers have to scale.
struct Units {
  double mass = 1, length = 1, time = 1;
};

/// One sphere on the other on a floor; mass 1 each and `top` at the top, h = 1 ms.
inline BodyProblem column_problem(int grains, double mu, double top = 1, Units units = {}) {
  BodyProblem problem;
  for (int k = 0; k < grains; ++k) {
    BodyUnknown body;
    body.mass = units.mass * (k + 1 == grains ? top : 1);
    body.spin_mass = mu > 0 ? 0.4 * body.mass : 0;
    body.radius = 0.01 * units.length;
    body.x = Vec3(0, 0, (2 * k + 1) * body.radius);
    body.free.u = Vec3(0, 0, -gravity * 1e-3) * units.length / units.time;
    problem.bodies.push_back(body);
    ContactEquation contact;
    contact.normal = Vec3::UnitZ();
    contact.offset = Vec3::Zero();
    contact.mu = mu;
    contact.first = k;
    contact.second = k - 1;
    problem.contacts.push_back(contact);
  }
  problem.grains = problem.bodies.size();
  problem.impulse.assign(problem.contacts.size(), Vec3::Zero());
  return problem;
}

/// Largest error of an impulse against the weight above, over the whole weight.
inline double column_error(const BodyProblem& problem) {
  double error = 0, due = 0;
  for (std::size_t k = problem.contacts.size(); k-- > 0;) {
    due -= problem.bodies[k].mass * problem.bodies[k].free.u[2];
    error = std::max(error, (problem.impulse[k] - due * Vec3::UnitZ()).norm());
  }
  return error / due;
}

}  // namespace talus::test
