#pragma once

/// How contacts and their forces are directed, in tensors of second order (Rothenburg & Bathurst 1989; in
/// three dimensions Guo & Zhao, Comput. Geotech. 47 (2013) 1-15, (7)-(13)).

#include "runtime/graph/communicator.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// Directions of the contacts between bodies that carry a force. Anisotropies are symmetric deviators:
/// contacts point along n with the density (1 + n.A_c n)/4 pi, the mean normal force there is
/// f_0 (1 + n.A_n n), and the tangential one f_0 (A_t n - (n.A_t n) n).
struct ForceFabric {
  double contacts = 0;
  Mat3 fabric = Mat3::Zero();  ///< mean of n (x) n
  Mat3 of_contacts = Mat3::Zero(), of_normal_forces = Mat3::Zero(), of_tangential_forces = Mat3::Zero();
};

/// The same bits on any ranks. Collective.
ForceFabric force_fabric(const StepState& state, const graph::Communicator& ranks);

/// The scalar of an anisotropy A beside the stress deviator s: sqrt(3/2) A : s/|s|, negative where A is
/// opposed to the stress; with it q/p = 0.4 (a_c + a_n + 1.5 a_t) to first order (Guo & Zhao 2013, (16)). 0
/// where s is.
double along_stress(const Mat3& anisotropy, const Mat3& stress_deviator);

/// The part of q/p along the stress deviator s of contacts that have these densities and forces and no
/// others, all products of two anisotropies included: between equal spheres sigma is in proportion to
///   1/3 (1 + 2/15 A_c : A_n) + 2/15 (A_c + A_n + 1.5 A_t) + dev(4 (A_c A_n + A_n A_c) + 3 (A_c A_t + A_t
///   A_c))/105.
/// In plane shear, of eigenvalues a, 0, -a, the last term lies across s, while what is added to p remains.
double stress_ratio_of(const ForceFabric& of, const Mat3& stress_deviator);

}  // namespace talus
