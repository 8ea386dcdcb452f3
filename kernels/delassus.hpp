#pragma once

/// Contact problems handed in as a matrix: u = W r + q with the Coulomb law at every contact
/// (kernels/friction_cone.hpp). Talus' own scenes never build W; users who bring FCLIB problems do. The
/// letters are FCLIB's.
///
///     const DelassusProblem problem = assemble_delassus(contacts, entries, q, mu);
///     std::vector<double> r(3 * contacts, 0.0);
///     const NlgsReport report = solve_nlgs(problem, {.tolerance = 1e-4}, r);

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "kernels/friction_cone.hpp"

namespace talus {

/// One scalar entry of W. Row 3c + k is component k (normal, tangent 1, tangent 2) of contact c.
struct MatrixEntry {
  std::int64_t row, column;
  double value;  ///< [1/kg]
};

/// W in rows of 3x3 blocks, the diagonal ones apart because the law of a contact needs them prepared.
/// Example, contacts 0-1 and 1-2 coupled: row_begin = {0, 1, 3, 4}, column = {1, 0, 2, 1}.
struct DelassusProblem {
  std::vector<std::int64_t> row_begin;  ///< contacts + 1 offsets into column and block
  std::vector<std::int32_t> column;     ///< contact of each off-diagonal block, ascending in a row
  std::vector<Mat3> block;              ///< [1/kg] W_ab, a != b; what the file did not store is 0
  std::vector<LocalBlock> diagonal;     ///< per contact: W_aa and mu
  std::vector<Vec3> q;                  ///< [m/s] per contact: the velocity without contact impulses

  std::size_t contacts() const { return q.size(); }
};

/// Gathers scalar entries, in any order, into blocks. Entries at the same place are added, as in CSparse;
/// blocks need not be complete. q has 3 and mu 1 value per contact. Throws std::invalid_argument when an
/// index is outside the matrix or the sizes disagree.
DelassusProblem assemble_delassus(std::span<const MatrixEntry> entries, std::span<const double> q,
                                  std::span<const double> mu);

/// u = W r + q, afresh [m/s]; r and u have 3 values per contact.
void relative_velocity(const DelassusProblem& problem, std::span<const double> r, std::span<double> u);

/// Two measures of the same natural map F_c = r_c - P_Kmu(r_c - (u_c + mu |u_T,c| n)).
struct DelassusError {
  /// Siconos 4.4.0, fc3d_compute_error: sqrt(sum |F_c|^2) / max(|q|, |r|, |u|), not divided when that maximum
  /// is below 2.2e-16. It adds velocities to impulses, so it depends on the units of the problem.
  double siconos = 0;
  /// The same after r_c sqrt(D_c), u_c / sqrt(D_c), q_c / sqrt(D_c), D_c = trace(W_cc) / 3: independent of
  /// units. Where the trace is not positive D_c = 1.
  double scaled = 0;
};

/// Both errors of (r, u = W r + q); `u` is computed and left to the caller. r and u have 3 values per
/// contact.
DelassusError delassus_error(const DelassusProblem& problem, std::span<const double> r, std::span<double> u);

struct NlgsOptions {
  double tolerance = 1e-4;                   ///< on DelassusError::siconos; 0 runs until a limit
  std::int64_t max_iterations = 10'000'000;  ///< sweeps, > 0
  double damping = 0.03;  ///< 0 to 1: part of trace(W_cc)/3 that holds a contact to its last impulse; 0: none
  double momentum = 1;    ///< 0 to 1: upper limit of the momentum factor; 0: none
  /// Asked after every sweep; true ends the solve. For time limits: kernels own no clock.
  std::function<bool()> stop = {};
};

struct NlgsCheck {
  std::int64_t iteration;
  DelassusError error;
};

struct NlgsReport {
  bool converged = false;
  std::int64_t iterations = 0;       ///< sweeps done
  DelassusError error;               ///< of the r handed back, computed afresh
  std::vector<NlgsCheck> history;    ///< at iteration 0 and at every check
  std::int64_t failed_contacts = 0;  ///< contacts whose local law had no solution in the last sweep
  std::int64_t rescues = 0;          ///< times a stalled iteration went back to its best r
};

/// Nonlinear Gauss-Seidel: contact by contact, the exact local law with the newest impulses of all others
/// (Jean and Moreau 1992). `r` (3 values per contact) is the start and takes the result. Three things are
/// added to the textbook's sweep:
///  - damping: from the second sweep on, the law is solved with W_cc + damping D_c I and q less damping D_c
///    r_c(old), D_c = trace(W_cc)/3: a proximal step, whose fixed points are the same. Without it NLGS (and
///    Siconos' NSGS) runs in circles on FCLIB's OneObject-i100000-316, where W is singular and unsymmetric.
///    On the development set 0.01 to 0.1 serve alike.
///  - momentum: a sweep starts from r_k + beta_k (r_k - r_k-1), beta_k Nesterov's, begun anew when the step
///  turns
///    back (O'Donoghue and Candes 2015) or grows by more than sqrt(2), in the norm with the weights D_c.
///    Where a plain sweep needs hundreds of iterations, 3 to 50 times fewer.
///  - rescue: without a better r for as many sweeps as the best one took (at least 1000), back to it, with a
///    momentum limit of 0.9, then 0, then again that of the options.
/// The error is computed afresh at sweeps 1, 2, 3, ... and then at intervals of a tenth of the sweeps done,
/// up to
/// 50. When the tolerance is not reached, the r of the least error of all checks is handed back. Same input,
/// same bits (but for where `stop` ends it).
NlgsReport solve_nlgs(const DelassusProblem& problem, const NlgsOptions& options, std::span<double> r);

}  // namespace talus
