#pragma once

/// Global balance: do the impulses carry what they must? The natural map looks at one contact at a time, and
/// on long chains and under heavy bodies each contact can be nearly satisfied while hardly anything of the
/// load is carried (docs/decisions/0012-stiff.md).

#include <span>

#include "kernels/bodies.hpp"
#include "kernels/motion.hpp"

namespace talus {

/// Sum of m |u - u_free|^2 + I/R^2 |w - w_free|^2 [J] over `slots`: what the impulses changed. Where copies
/// of a body carry its whole mass (Schwarz), `multiplicity` divides.
double gained_energy(std::span<const Slot> slots, const FreeVelocity& free,
                     std::span<const Velocity> velocity, Multiplicities multiplicity = {});

/// Part of the load that is not carried, from the work that the impulses would still do,
///
///   sum_contacts |r . v^| / |V - V_free|_M^2,   v^ = v + (b + mu |v_t|) n
///
/// At the solution r and v^ are orthogonal at every contact, and it is 0. Proof that it sees through chains:
/// sum r.v = (V - V_free)^T M V, so a body that keeps the part f of its fall under impulses balanced below it
/// shows f/(1 - f), however long the chain over which the approach is spread. A plate of which 1 % is carried
/// shows 99. `work` [J]: of ErrorSums; `gained` [J]: gained_energy of bodies and walls.
inline double unbalance(double work, double gained) {
  return gained > 0 ? work / gained : 0;
}

}  // namespace talus
