#pragma once

#include <string>
#include <vector>

#include "kernels/shapes/walls.hpp"

namespace talus::io::detail {

/// What is wrong between wall k and one of those before it: they face the same way, so that one lies inside
/// the other, or they face each other with no room between them. "" when nothing is, or when a position is
/// not known yet (NaN).
std::string wall_conflict(const std::vector<Wall>& walls, std::size_t k);

}  // namespace talus::io::detail
