/// Reads an FCLIB file with fclib's own reader, solves it with Siconos' NSGS, and prints what a test
/// compares:
///     nsgs FILE TOLERANCE
/// stdout: "info ERROR" of NSGS, "given ERROR" of /solution by fc3d_compute_error, then the velocities u, one
/// a line. A program of its own, since fclib is linked with another HDF5 than Talus.

#include <siconos/numerics/FrictionContactProblem.h>
#include <siconos/numerics/Friction_cst.h>
#include <siconos/numerics/NonSmoothDrivers.h>
#include <siconos/numerics/NumericsMatrix.h>
#include <siconos/numerics/SolverOptions.h>
#include <siconos/numerics/fc3d_Solvers.h>
#include <siconos/numerics/fc3d_compute_error.h>

extern "C" {
#include <fclib.h>  // forgets to say that it is C
}

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  fclib_local* file = fclib_read_local(argv[1]);
  if (!file || file->spacedim != 3 || file->W->nz != -2) return 2;
  const int rows = file->W->m, contacts = rows / 3;
  std::vector<double> W(static_cast<std::size_t>(rows) * static_cast<std::size_t>(rows), 0.0);
  for (int row = 0; row < rows; ++row)  // dense storage is by columns
    for (int k = file->W->p[row]; k < file->W->p[row + 1]; ++k)
      W[static_cast<std::size_t>(file->W->i[k]) * static_cast<std::size_t>(rows) +
        static_cast<std::size_t>(row)] += file->W->x[k];
  NumericsMatrix* M = NM_create_from_data(NM_DENSE, rows, rows, W.data());
  FrictionContactProblem* problem = frictionContactProblem_new_with_data(3, contacts, M, file->q, file->mu);
  SolverOptions* options = solver_options_create(SICONOS_FRICTION_3D_NSGS);
  options->dparam[SICONOS_DPARAM_TOL] = std::atof(argv[2]);
  options->iparam[SICONOS_IPARAM_MAX_ITER] = 1000000;

  std::vector<double> r(static_cast<std::size_t>(rows), 0.0), u(r);
  const int info = fc3d_driver(problem, r.data(), u.data(), options);
  double squared = 0;
  for (int k = 0; k < rows; ++k) squared += file->q[k] * file->q[k];
  const double norm = std::sqrt(squared);
  double error = 0, given = 0;
  fc3d_compute_error(problem, r.data(), u.data(), 1, options, norm, &error);
  if (const fclib_solution* solution = fclib_read_solution(argv[1])) {
    std::vector<double> velocity(r.size());
    fc3d_compute_error(problem, solution->r, velocity.data(), 1, options, norm, &given);
  }
  std::printf("%d %.17g\ngiven %.17g\n", info, error, given);
  for (const double value : u) std::printf("%.17g\n", value);
  return 0;
}
