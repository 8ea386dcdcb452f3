#pragma once

/// How stiff a problem is, before it is solved: what rho of ADMM is chosen from.

#include <span>

#include "kernels/global/body_parts.hpp"

namespace talus {

/// kappa of rho = kappa/W_nn before any impulse is known: about the inverse of the smallest eigenvalue of W
/// that the load excites, in effective masses of a contact, sum W_nn r^2 / |M^-1/2 H r|^2. A column of N
/// grains: 2 N^2/3; a plate of T grain masses over L layers of c contacts: T L/c. For r, the momentum that
/// stops every body at once is passed on, layer by layer over the contacts, to the driven walls; in a cluster
/// that touches none, to its heaviest body. Also about the number of Gauss-Seidel sweeps that the problem
/// needs. 0 without contacts. With several parts, an exchange for each layer on the way out and one on the
/// way back.
double estimate_stiffness(std::span<const ContactGraph> parts, const PartLink& link);
double estimate_stiffness(const BodyParts& parts);
double estimate_stiffness(const BodyProblem& problem);

/// Of a dense packing.
struct CellStiffness {
  double contacts = 6;  ///< of a grain, among which it shares what it has to get, >= 1
};

/// The same of a periodic cell that follows a stress or has no walls, by its size. Nothing is handed on there
/// to any one body: what contacts tell one another diffuses over half of the cell, which is so many `layers`
/// of grains along its longest edge; to a grain of `spread` times the mass of the lightest, the heaviest, as
/// to a plate.
double stiffness_of_cell(double layers, double spread, const CellStiffness& of = {});

/// 1/W_nn of a contact [kg]; mass(unknown) [kg].
template <class Mass>
double effective_mass_by(const Mass& mass, const ContactEquation& c) {
  const auto mobility = [&](std::int32_t body) {
    return body < 0 ? 0 : 1 / mass(static_cast<std::size_t>(body));
  };
  return 1 / (mobility(c.first) + mobility(c.second) + c.branch.squaredNorm() * mobility(c.cell));
}
inline double effective_mass(const BodyProblem& problem, const ContactEquation& c) {
  return effective_mass_by([&](std::size_t body) { return problem.bodies[body].mass; }, c);
}

}  // namespace talus
