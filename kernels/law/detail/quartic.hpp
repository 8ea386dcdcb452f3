#pragma once

/// Roots of a quartic, for blocks on which the sliding equation's bracket fails
/// (kernels/law/friction_cone.cpp).

#include <array>
#include <optional>

namespace talus::detail {

/// Real parts of the four roots of x^4 + a[3] x^3 + a[2] x^2 + a[1] x + a[0], as eigenvalues of its companion
/// matrix, in their order. None if a coefficient is not finite or the iteration for eigenvalues fails.
std::optional<std::array<double, 4>> real_parts_of_roots(const std::array<double, 4>& a);

}  // namespace talus::detail
