#pragma once

/// The contact and the body with the largest errors of a step that has not converged, by their names.

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/bodies/types.hpp"
#include "kernels/global/residuals.hpp"
#include "runtime/step/overlap.hpp"

namespace talus {

/// Residuals over the step's velocities, as error_max (kernels/global/residuals.hpp).
struct WorstErrors {
  double contact_error = 0;  ///< of the contact that is furthest from its law
  BodyPair contact;          ///< its bodies; none where every contact satisfies its law
  double body_error = 0;     ///< largest change that its contacts would make to the velocity of a body
  std::int64_t body = 0;     ///< its id; wall w as -1 - w. Means nothing where body_error is 0

  /// Keeps the worse of both, and of equal ones that of smaller names.
  void take(const WorstErrors& other);
};

/// Names of the unknowns of a problem.
struct UnknownNames {
  std::vector<std::span<const BodyId>> bodies;  ///< per part: ids of the unknowns before the first wall
  std::vector<std::int32_t> walls;              ///< numbers of the others, the same in every part
};

/// The worst errors among the parts of this rank.
WorstErrors worst_errors_of(const ProblemReaders& parts, const Residuals& residuals,
                            const UnknownNames& names);

}  // namespace talus
