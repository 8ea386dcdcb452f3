#pragma once

/// Contact problems handed in as a matrix: u = W r + q with the Coulomb law at every contact
/// (kernels/law/friction_cone.hpp). Talus' own scenes never build W; users who bring FCLIB problems do. The
/// letters are FCLIB's.
///
///     const DelassusProblem problem = assemble_delassus(contacts, entries, q, mu);
///     std::vector<double> r(3 * contacts, 0.0);
///     const DelassusReport report = solve_delassus(problem, DelassusMethod::automatic, {.tolerance = 1e-4},
///     r);
/// (kernels/delassus/delassus_solve.hpp)

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "kernels/law/friction_cone.hpp"

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
  /// 3, or 2 for a problem of the plane, of which every contact has got a second tangent that nothing excites
  /// (embed_plane).
  int dimension = 3;

  std::size_t contacts() const { return q.size(); }
};

/// q_a + sum of W_ab r_b over b != a: what the others do to contact a [m/s]. 9 doubles and 18 flops a block.
inline Vec3 velocity_from_others(const DelassusProblem& p, std::span<const double> r, std::size_t a) {
  Vec3 u = p.q[a];
  const auto end = static_cast<std::size_t>(p.row_begin[a + 1]);
  for (auto k = static_cast<std::size_t>(p.row_begin[a]); k < end; ++k)
    u += p.block[k] * Eigen::Map<const Vec3>(r.data() + 3 * static_cast<std::size_t>(p.column[k]));
  return u;
}

/// Gathers scalar entries, in any order, into blocks. Entries at the same place are added, as in CSparse;
/// blocks need not be complete. q has 3 and mu 1 value per contact. Throws std::invalid_argument when an
/// index is outside the matrix or the sizes disagree.
DelassusProblem assemble_delassus(std::span<const MatrixEntry> entries, std::span<const double> q,
                                  std::span<const double> mu);

/// The same for a problem of the plane, 2 rows (normal, tangent) and 2 values of q a contact. The contacts
/// get a second tangent with the diagonal (W_NN + W_TT)/2 and no coupling, in which impulses and velocities
/// stay 0: the cone becomes the interval |r_T| <= mu r_N, trace/3 the mean diagonal of the plane, and both
/// errors are those of the plane's problem.
DelassusProblem embed_plane(std::span<const MatrixEntry> entries, std::span<const double> q,
                            std::span<const double> mu);

/// Components 0 and 1 of every contact: how a file of the plane wants r and u.
std::vector<double> plane_components(std::span<const double> values);

/// The problem in variables without units: r' = sqrt(D) r, u' = u / sqrt(D), q' likewise, with D_c =
/// trace(W_cc)/3 (1 where that is not positive). Its diagonal blocks have the mean diagonal 1, and its plain
/// natural map is the scaled error's.
struct UnitDiagonal {
  DelassusProblem problem;
  std::vector<double> root;  ///< sqrt(D_c)
};
UnitDiagonal unit_diagonal(const DelassusProblem& problem);

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

enum class ErrorMeasure {
  siconos,  ///< DelassusError::siconos
  scaled,   ///< DelassusError::scaled
  larger,   ///< the larger of the two: neither hides what the other shows
};
double measured(const DelassusError& error, ErrorMeasure measure);

/// When a solver ends.
struct DelassusGoal {
  double tolerance = 1e-4;  ///< on the measure; 0 runs until a limit
  ErrorMeasure measure = ErrorMeasure::larger;
  std::int64_t max_iterations = 10'000'000;  ///< of the method, >= 0
  /// Multiplications (DelassusReport::work) after which solve_auto begins no other slice, > 0.
  double most_work = std::numeric_limits<double>::infinity();
  /// Asked after every iteration; true ends the solve. For time limits: kernels own no clock.
  std::function<bool()> stop = {};
};

struct DelassusCheck {
  std::int64_t iteration;
  DelassusError error;
};

/// What a solver did. The r it hands back is that of the least error of all checks.
struct DelassusReport {
  bool converged = false;
  bool stopped = false;                ///< by DelassusGoal::stop
  std::int64_t iterations = 0;         ///< sweeps, steps of ADMM and of Newton together
  std::int64_t factorisations = 0;     ///< of these, how many factorised a matrix
  DelassusError error;                 ///< of the r handed back, computed afresh
  std::vector<DelassusCheck> history;  ///< at iteration 0 and at every check
  std::int64_t failed_contacts = 0;    ///< contacts whose local law had no solution in the last sweep
  std::int64_t rescues = 0;            ///< times a stalled iteration went back to its best r
  /// Multiplications, as estimated: what methods are compared by without a clock. One takes 0.3 to 1 ns.
  double work = 0;
};

/// Keeps the r of the least error and the history of one solve. All solvers share it.
class BestAnswer {
 public:
  /// Judges the start. `r` takes the answer at `hand_back`, and must outlive this.
  BestAnswer(const DelassusProblem& problem, const DelassusGoal& goal, std::span<double> r);
  /// Judges `candidate` (3 per contact) as the result of `iteration`; true when it is the best so far.
  bool offer(std::int64_t iteration, std::span<const double> candidate);
  bool done() const { return report_.converged; }
  /// Counts an iteration and asks the goal whether to stop. True: the solve ends with it, so that its result
  /// must be offered.
  bool count();
  /// Converged, stopped or out of iterations.
  bool over() const {
    return report_.converged || report_.stopped || report_.iterations >= goal_.max_iterations;
  }
  std::span<const double> best() const { return best_; }
  double last() const { return last_; }
  double least() const { return least_; }
  const DelassusGoal& goal() const { return goal_; }
  DelassusReport& report() { return report_; }
  /// Copies the best r to where the solve began, and hands the report over.
  DelassusReport hand_back();

 private:
  const DelassusProblem& problem_;
  const DelassusGoal& goal_;
  std::span<double> out_;
  std::vector<double> best_, u_;
  double least_ = 0, last_ = 0;
  DelassusReport report_;
};

}  // namespace talus
