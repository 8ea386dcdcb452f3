#pragma once

/// Taking the Newton step that a check has found (correction.hpp).

#include <span>

#include "kernels/global/body_parts.hpp"

namespace talus {

/// How far impulses are from the law.
struct LawDefect {
  double residual2 = 0;   ///< sum of |r - P_Kmu(r - (v + mu |v_t| n)/W_nn)|^2 W_nn over the contacts [J]
  double energy = 0;      ///< dual objective 1/2 |V(r)|_M^2 + r.offset, which the answer makes least without
                          ///< friction [J]
  bool friction = false;  ///< of a contact
};
LawDefect law_defect(const BodyParts& parts);

/// Adds `change` to the impulses of all parts, puts them on the cones, and returns whether they are nearer to
/// the law than before: by the residual, or without friction by the dual objective, which falls also where a
/// step has not settled. Where they are not, they are left as they were. Collective.
bool take_newton_step(std::span<BodyProblem> parts, const PartLink& link, const PartImpulses& change);

}  // namespace talus
