#pragma once

/// Contact problems with the masses still in them (FCLIB's "global" form) and their condensation to W.

#include <span>
#include <vector>

#include "kernels/delassus/delassus.hpp"

namespace talus {

/// M v = H r + G l + f,  G' v + b = 0,  u = H' v + w, with the contact law between u and r. FCLIB's letters;
/// n degrees of freedom, c contacts of `dimension` 2 or 3 (normal first), e equality constraints (often 0).
struct GlobalProblem {
  int dimension = 3;
  std::vector<MatrixEntry> M;  ///< n x n [kg]; regular, need not be symmetric
  std::vector<MatrixEntry> H;  ///< n x (dimension c)
  std::vector<MatrixEntry> G;  ///< n x e
  std::vector<double> f;       ///< n [N s]
  std::vector<double> w;       ///< dimension c [m/s]
  std::vector<double> b;       ///< e [m/s]
  std::vector<double> mu;      ///< c
};

/// W = H' A H and q = w + H' A f, where A is the inverse of M (with G: its part of the inverse of the saddle
/// matrix). The matrix falls apart into the bodies (its connected blocks), each of which is factorised by
/// itself, so that W costs what its entries cost. W is not symmetrised. A problem of the plane is embedded
/// (embed_plane). Throws std::invalid_argument when sizes disagree or a body's matrix is singular, with the
/// first row of the body.
DelassusProblem condense(const GlobalProblem& problem);

struct GlobalVelocity {
  std::vector<double> v;  ///< n [m/s]
  std::vector<double> l;  ///< e: multipliers
};

/// v and l of the impulses r (`dimension` values per contact).
GlobalVelocity global_velocity(const GlobalProblem& problem, std::span<const double> r);

}  // namespace talus
