#pragma once

/// Contact problems in FCLIB's HDF5 layout (docs/formats.md; github.com/FrictionalContactLibrary/fclib):
/// /fclib_local without the mixed part (V, R, s), and /fclib_global, in the plane and in space.

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kernels/delassus/delassus.hpp"
#include "kernels/delassus/global_problem.hpp"

namespace talus::io {

struct FclibProblem {
  DelassusProblem contact;              ///< as given, condensed from `global`, or embedded from the plane
  std::optional<GlobalProblem> global;  ///< of a file with /fclib_global
};

/// Matrices may be stored by compressed rows, compressed columns or triplets, with incomplete blocks.
/// Everything that the solver relies on is checked: sizes, offsets, index ranges, finite numbers, mu >= 0, a
/// regular M. Throws FileError, which names the file, the dataset, the value and a remedy.
FclibProblem read_fclib_problem(const std::filesystem::path& path);

/// Its contact problem alone.
DelassusProblem read_fclib(const std::filesystem::path& path);

/// A problem in a folder, by the name that tables give it.
struct FclibFile {
  std::filesystem::path path;
  std::string name;  ///< of the file, without its ending where no other has the same; with its folders where
                     ///< another has the same name in another folder
};

/// The .hdf5 and .h5 files of a folder and those below it, sorted, but for results and traces of runs; or the
/// file that `path` names. Throws FileError when a folder holds none.
std::vector<FclibFile> fclib_files(const std::filesystem::path& path);

/// What a file's /solution holds, in its dimension (2 or 3 values per contact).
struct FclibSolution {
  std::vector<double> r;  ///< [N s]
  std::vector<double> u;  ///< [m/s]
  std::vector<double> v;  ///< [m/s] of the degrees of freedom; global problems only
  std::vector<double> l;  ///< multipliers of the equality constraints; global problems that have some
};

/// From the impulses (3 per contact) of the contact problem.
FclibSolution fclib_solution(const FclibProblem& problem, std::span<const double> r);

/// Copies `input` to `out` with the solution as /solution in it, in place of one that was there. `out`
/// appears complete or not at all: it is written beside its place and renamed. An existing `out` is replaced.
/// Throws FileError.
void write_fclib_solution(const std::filesystem::path& input, const std::filesystem::path& out,
                          const FclibSolution& solution);

/// /fclib_local/info of a file.
struct FclibInfo {
  std::string title, description, math_info;
};

/// Writes an fclib_local file that fclib and Siconos read: W as compressed rows with complete blocks, q, mu,
/// info, and /solution unless it is empty. Complete or not at all; an existing file is replaced. Throws
/// FileError, also when W has more entries than FCLIB's 32-bit counts allow.
void write_fclib(const DelassusProblem& problem, const FclibSolution& solution, const FclibInfo& info,
                 const std::filesystem::path& out);

}  // namespace talus::io
