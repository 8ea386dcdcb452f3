#pragma once

/// Bodies of a periodic cell together with their images beside its faces. A broad phase that knows nothing of
/// cells finds the pairs across a face among them.

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/detection/broad_phase.hpp"
#include "kernels/detection/domain.hpp"

namespace talus {

/// The bodies in their order, then images of some of them. Of each pair across a face one body, not both, has
/// the image that is near the other: images are those by k > 0, compared along z, then y, then x.
struct ImagedBodies {
  std::vector<Vec3> x;         ///< [m]
  std::vector<double> reach;   ///< [m]
  std::vector<Slot> original;  ///< of image `bodies + k`
};

/// `x` [m] in the brick of the domain; sizes as in build_cells.
ImagedBodies with_images(const Domain& domain, std::span<const Vec3> x, std::span<const double> reach);

/// Turns the pairs that were found among bodies and images into pairs of bodies. Drops pairs of two images,
/// which are found elsewhere as pairs with a body, and pairs of a body with an image of itself, which do not
/// touch in a cell that is large enough (check_cell of runtime/step).
void fold_images(std::size_t bodies, std::span<const Slot> original, std::vector<GrainPair>& pairs);

/// Two bodies within reach of two images of one another, as fast ones may be, are one candidate: leaves each
/// pair once. `pairs` in order (sort_pairs).
void drop_repeated(std::vector<GrainPair>& pairs);

/// The pairs nearer than the sum of their reaches in the domain, each once, in no promised order. Sizes as in
/// build_cells; x [m] may lie anywhere.
std::vector<GrainPair> near_pairs(const Domain& domain, std::span<const Vec3> x,
                                  std::span<const double> reach);

}  // namespace talus
