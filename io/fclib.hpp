#pragma once

/// Contact problems in FCLIB's HDF5 layout (docs/formats.md; github.com/FrictionalContactLibrary/fclib).
/// Only /fclib_local of dimension 3 without the mixed part (V, R, s) is read.

#include <filesystem>
#include <span>

#include "kernels/delassus.hpp"

namespace talus::io {

/// Reads the problem u = W r + q. W may be stored by compressed rows, compressed columns or triplets, with
/// incomplete blocks. Everything that the solver relies on is checked: sizes, offsets, index ranges, finite
/// numbers, mu >= 0. Throws FileError, which names the file, the dataset, the value and a remedy.
DelassusProblem read_fclib(const std::filesystem::path& path);

/// Throws FileError when `out` cannot be meant: it is the input itself (under whatever name), or its folder
/// is not there. To be asked before a long solve.
void check_fclib_output(const std::filesystem::path& input, const std::filesystem::path& out);

/// Copies `input` to `out` with /solution/r [N s] and /solution/u [m/s] in it, in place of a solution that
/// was there. `out` appears complete or not at all: it is written beside its place and renamed. An existing
/// `out` is replaced. Throws FileError.
void write_fclib_solution(const std::filesystem::path& input, const std::filesystem::path& out,
                          std::span<const double> r, std::span<const double> u);

}  // namespace talus::io
