#pragma once

#include <filesystem>

namespace talus {

/// `talus solve`: one FCLIB problem.
struct SolveOptions {
  std::filesystem::path path;  ///< the problem
  double tol = 1e-4;           ///< on Siconos' error measure, > 0
  double max_seconds = 60;     ///< elapsed time after which the best answer so far is handed back, > 0
  std::filesystem::path out;   ///< copy of the problem with the solution in it; empty: none
};

/// Reads, solves, prints one line of JSON on stdout: problem, contacts, method, error, scaled_error,
/// iterations, seconds (of the solve alone), converged. Errors go to stderr. Returns the exit code: 0 done, 1
/// failure, 2 bad input, 3 tolerance missed (the answer is written all the same).
int solve_command(const SolveOptions& options);

}  // namespace talus
