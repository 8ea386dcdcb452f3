#pragma once

/// How much work the contacts' errors do in each of several clusters: what is small against all may be much
/// in one.

#include <span>

#include "kernels/global/body_parts.hpp"
#include "kernels/global/problem_reader.hpp"

namespace talus {

/// What the clusters of a step exchange at least.
struct ExchangeFloors {
  double speed = 0;     ///< of their grains: what rounding makes [m/s]
  double interest = 0;  ///< part of the impulse at the wall that a cluster presses most, in (0, 1)
  std::span<const double> wall_inv_masses = {};  ///< of all walls [1/kg]; 0: it is driven or fixed
};

/// Per cluster sum r_n |e| over the energy that its contacts exchange, e the residual of a contact
/// (docs/decisions/0030-work-of-errors.md); the largest [1]. The energy is sum m |u - u_free|^2/2 of grains
/// and pushed walls, of which light ones count with the mass of the cluster; no less than that of grains that
/// follow the fastest wall they touch, or move as fast as the floors say. `groups`: the clusters. Collective:
/// a sum over copies and a gather.
double largest_work(const ProblemReaders& parts, const BodyGroups& groups, const PartLink& link,
                    const ExchangeFloors& floors);

}  // namespace talus
