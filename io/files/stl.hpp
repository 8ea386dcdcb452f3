#pragma once

#include <string>
#include <vector>

#include "kernels/shapes/shape.hpp"

namespace talus::io {

/// Reads the triangles of an STL file [m], in their order; normals in the file are not used, as the corners
/// tell them. A file is binary when its length is what its number of triangles says (80 bytes, that number in
/// 4, and 50 a triangle), else it is text, "solid ... endsolid", in small letters or capitals, with line ends
/// of any system, with or without a byte order mark. No more memory is used than the file's length asks for.
/// Throws FileError with file, and line or triangle (counted from 1), when the file cannot be read, ends
/// early, holds another word than is expected, or a coordinate that is not a finite number.
std::vector<Triangle> read_stl(const std::string& path);

/// The text of an STL file with these triangles, to the last bit [m].
std::string stl_text(const std::vector<Triangle>& triangles);

}  // namespace talus::io
