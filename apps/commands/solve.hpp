#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace talus {

/// `talus solve`: FCLIB problems.
struct SolveOptions {
  std::filesystem::path path;      ///< a problem, or a folder of problems (*.hdf5, *.h5, in order of name)
  std::string method = "auto";     ///< of kernels/delassus/delassus_solve.hpp, or "all"
  double tol = 1e-4;               ///< > 0
  std::string measure = "larger";  ///< larger, siconos or scaled: the error that tol is asked of
  double max_seconds = 60;         ///< elapsed time of one solve, after which its best answer is taken, > 0
  int repeat = 1;                  ///< solves of each problem, of which the median time is told, >= 1
  std::filesystem::path out;       ///< copy of the one problem with the solution in it; empty: none
  std::filesystem::path csv;       ///< table of all solves; empty: none
  std::filesystem::path profile;   ///< performance profile of the methods; empty: none
  bool force = false;              ///< replace files that are there
};

/// Reads and solves. One problem with one method: one line of JSON on stdout: problem, contacts, method,
/// error (Siconos' measure), scaled_error, iterations, seconds (processor time of the solve alone),
/// converged. A folder, or all methods: a table. Errors go to stderr. Returns an ExitCode: 2 when an option
/// or a file is bad (the other files are solved all the same), 1 when a file cannot be written, 3 when a
/// problem's tolerance was missed by all methods asked for.
int solve_command(const SolveOptions& options);

}  // namespace talus
