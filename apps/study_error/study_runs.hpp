#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/study_error/study_variants.hpp"
#include "kernels/detection/domain.hpp"

namespace talus {

/// A whole run against the reference of its seed.
struct RunRow {
  StudyVariant variant;
  double tolerance = 0;
  double time_step = 1;                            ///< factor of the scene's
  std::int64_t steps = 0, sweeps = 0, missed = 0;  ///< missed: steps that were not converged
  double seconds = 0;  ///< elapsed time of all steps, median of the repetitions [s]
  double stress_error =
      0;  ///< rms over the steps of q/p less the reference's; NaN when the walls close no box
  double position_error = 0;  ///< rms_distance from the reference at the end, over the mean diameter; NaN
                              ///< when the run ended at another time
};

struct RunReference {
  std::uint64_t seed = 1;
  double tolerance = 0, time_step = 1;
  std::int64_t steps = 0, missed = 0;
  double time = 0;     ///< [s] simulated
  double seconds = 0;  ///< [s] elapsed
};

struct RunStudy {
  std::vector<RunRow> rows;  ///< those that differ in the tolerance alone follow one another
  std::vector<RunReference> references;
  std::vector<std::vector<std::array<double, 2>>> curves;  ///< per reference: time [s] and q/p
};

/// Runs the beginning of the scene with every variant of its seed, tolerance and time step, and once with the
/// smallest time step, a tenth of the smallest tolerance and four times the sweeps: the reference. The
/// simulated time is that of `plan.steps` steps of the first stage, or the scene's. Stages that end after
/// steps end after the same time. Adds to `study`; `keep` is called behind every run, of which one that fails
/// is said and left out. Throws what Simulation throws for the reference.
void study_runs(const StudySample& sample, const StudyPlan& plan,
                const std::function<void(const std::string&)>& say, const std::function<void()>& keep,
                RunStudy& study);

/// Root mean square of the distances of points from those of the reference, the shortest way in the domain,
/// as one run may have wrapped a point into the periodic cell on another side than the other run [m].
double rms_distance(std::span<const Vec3> x, std::span<const Vec3> reference, const Domain& domain);

/// Why runs of the scene with that factor of the time step would make no step, or a stage of them none: key
/// and remedy; "" when they make some.
std::string why_no_step(const io::Scene& scene, const StudyPlan& plan, double time_step);

/// Rms difference of the references' q/p from one seed to another: an error below is lost in it. NaN with one
/// seed, or without q/p.
double scatter_of_seeds(const RunStudy& study);

}  // namespace talus
