#pragma once

/// triaxial.csv, read back.

#include <filesystem>
#include <vector>

#include "runtime/step/frame.hpp"

namespace talus::io {

/// The rows of a table as append_triaxial_row wrote them, to the bit; none where there is no such file.
/// Throws FileError when a line has another number of cells, or a cell is no number.
std::vector<TriaxialReport> read_triaxial(const std::filesystem::path& path);

}  // namespace talus::io
