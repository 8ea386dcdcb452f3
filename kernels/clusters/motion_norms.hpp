#pragma once

/// Sums and norms of the motions of a cluster's bodies.

#include <vector>

#include "kernels/global/body_problem.hpp"

namespace talus {

/// a + part b, per unknown.
std::vector<Twist> added(const std::vector<Twist>& a, double part, const std::vector<Twist>& b);

/// Sum m |u| + (I/R^2) |w| over the unknowns [N s].
double momentum_of(const BodyProblem& problem, const std::vector<Twist>& motion);

/// |motion|_M [J^(1/2)].
double kinetic_norm(const BodyProblem& problem, const std::vector<Twist>& motion);

}  // namespace talus
