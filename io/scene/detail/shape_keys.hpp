#pragma once

#include <string>
#include <vector>

#include "io/scene/detail/scene_key.hpp"
#include "kernels/shapes/walls.hpp"

namespace talus::io::detail {

/// The key `shape`, and a key for each parameter of a shape, once where several shapes have one of that name.
std::vector<Key<Wall>> shape_keys();

/// Keys that have a meaning for planes only.
void keep_for_planes(std::vector<Key<Wall>>& keys);

/// Makes the surface of a wall whose keys are read, from its file, too, if its shape has one. Throws
/// std::invalid_argument or FileError with the parameter, or the file and its triangle or line.
void read_surface(Wall& wall);

}  // namespace talus::io::detail
