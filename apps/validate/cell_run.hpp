#pragma once

/// Runs of spheres in a periodic cell. In units of the diameter of equal ones, their density and the
/// pressure, so that times are inertial times d (rho/p)^1/2 and a rate of shear is an inertial number.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/validate/validation_case.hpp"
#include "kernels/samples/sample.hpp"
#include "runtime/step/frame.hpp"
#include "runtime/step/setup.hpp"
#include "runtime/step/simulation.hpp"

namespace talus::literature {

/// A sample and the stages that it goes through.
struct CellPlan {
  std::int64_t grains = 1000;
  std::uint64_t seed = 1;
  std::vector<Stage> stages;
  Effort effort;
  double slender = 1;              ///< height of the cell over its width
  std::vector<double> radii{0.5};  ///< dealt to the grains in turn
};

/// Presses with 1 along all axes, until the sample rests (StageEnd::equilibrium) or for `most` inertial
/// times.
Stage press_stage(double friction, double rest = 1e-3, double most = 60);
/// Shears at a rate along x over z under 1 along all axes, by `strain` in all.
Stage shear_stage(double friction, double rate, double strain);

/// Squeezes at a rate along z, under 1 along x and y, by a strain of `strain`.
Stage triaxial_stage(double friction, double rate, double strain);

/// Runs a setup to its end, on one rank; `look` sees the simulation behind each step. Steps, and those over
/// their tolerance, are counted.
struct StepCount {
  std::int64_t steps = 0, missed = 0;
};
StepCount run_to_end(const Setup& setup, Sample sample, int threads,
                     const std::function<void(const Simulation&)>& look);

struct CellRun {
  std::vector<CellReport> rows;  ///< every tenth step
  std::vector<double> sheared;   ///< per row: path of shear since its stage began
  Frame last;                    ///< with its contacts
  std::int64_t steps = 0, missed = 0;
};
CellRun run_cell(const CellPlan& plan);

/// A mean over seeds, each of which gave one number.
struct Mean {
  double value = 0, error = 0;  ///< standard error
};
Mean mean_of(std::span<const double> numbers);

/// Of the rows of a stage beyond a path of shear, or its last row.
double mean_over(const CellRun& run, const std::string& stage, double from,
                 const std::function<double(const CellReport&)>& of);
const CellReport& last_of(const CellRun& run, const std::string& stage);

/// The ratio of shear stress, xz, and mean stress.
inline double shear_ratio(const CellReport& row) {
  return -row.stress[4] / row.p;
}

}  // namespace talus::literature
