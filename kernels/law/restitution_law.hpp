#pragma once

/// Which impact law holds where pairs have a restitution, and how the solver gets by with one law.
///
/// Moreau's law is Signorini's and Coulomb's on the whole mean velocity of an impact. With one number E >= e
/// of all pairs of a step (`reflection_of`) the unknown is
///
///     vbar = (v + E v-)/(1 + E),       0 <= vbar_n + b  _|_  r_n >= 0,      r_t as Coulomb's law says for
///     vbar_t
///
/// with b >= 0, which gives each pair its own e (gap_law.hpp). As vbar depends on impulses as v does, only
/// smaller by 1 + E, this is the inelastic problem of a step whose loads act for h/(1 + E); its velocities
/// are carried on to V = (1 + E) Vbar - E V- afterwards (kernels/bodies/motion.hpp). No kernel knows of it,
/// and contact forces are the impulses found over h/(1 + E). Contacts cannot create energy so
/// (docs/theory.md, "Gap term and restitution"); Newton's law, a bias of the normal velocity alone, can.

#include "kernels/law/pair_table.hpp"

namespace talus {

enum class RestitutionLaw {
  moreau,  ///< normal velocities rebound with e of the pair, tangential ones that stick with E
  newton,  ///< normal velocities rebound with e, tangential ones that stick stop; may create energy
};

/// E in [0, 1]: the largest restitution of any pair with Moreau's law, 0 with Newton's.
inline double reflection_of(RestitutionLaw law, const PairTable& laws) {
  return law == RestitutionLaw::moreau ? laws.largest(&PairLaw::restitution) : 0;
}

}  // namespace talus
