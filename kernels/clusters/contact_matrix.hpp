#pragma once

/// A problem over bodies as one of relative velocities and a stored matrix, u = W r + q
/// (kernels/delassus/delassus.hpp): for solvers that want W.

#include <cstddef>
#include <vector>

#include "kernels/delassus/delassus.hpp"
#include "kernels/global/body_problem.hpp"

namespace talus {

/// The problem and its impulses, in frames (normal, tangent 1, tangent 2) of the contacts.
struct ContactMatrix {
  DelassusProblem problem;
  std::vector<double> r;     ///< 3 per contact [N s]
  std::vector<Mat3> frames;  ///< per contact: columns n, t, s

  /// Impulses in space, one per contact [N s].
  std::vector<Vec3> impulses() const;
};

/// Blocks off the diagonal of its matrix, told without it: pairs of contacts of a body, in both places. Those
/// of contacts between the same two bodies count twice.
std::size_t blocks_of(const BodyProblem& problem);

/// Of a whole problem, in one part. Bodies that do not turn have no spin mass.
ContactMatrix matrix_of(const BodyProblem& problem);

}  // namespace talus
