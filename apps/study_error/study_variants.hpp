#pragma once

/// What `talus study error` varies, and the samples it varies it on.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/scene/scene.hpp"
#include "kernels/bodies/bodies.hpp"

namespace talus {

/// One way to solve.
struct StudyVariant {
  std::string method;  ///< a name of methods()
  int subdomains = 1;
  int threads = 1;
  std::uint64_t seed = 1;
};

/// What is to be measured; lists are not empty and their values make sense.
struct StudyPlan {
  std::vector<StudyVariant> variants;  ///< sorted by seed
  std::vector<double> tolerances;      ///< on the residual, descending
  std::vector<double> time_steps;      ///< factors of the scene's time steps, descending
  std::int64_t at_step = 0;            ///< steps before the one problem
  std::int64_t steps = 0;              ///< length of a whole run, in time steps of the first stage
  int max_sweeps = 0;                  ///< of a solve of the one problem
  double max_seconds = 0;              ///< of a solve: none is begun that would take longer
};

/// The scene with one seed, and its grains; walls are placed.
struct StudySample {
  io::Scene scene;
  Bodies bodies;
};
StudySample study_sample(const std::string& path, const std::vector<std::string>& overrides,
                         std::uint64_t seed);

/// `solver` asked for another tolerance (> 0). Its balance_tolerance keeps its ratio to the tolerance, but
/// becomes no looser: a residual that stiff samples meet early says little without it.
SolverSettings at_tolerance(SolverSettings solver, double tolerance);

/// Steps after which the stages have ended at the latest; infinite where one waits for a strain or an
/// equilibrium alone.
double most_steps(std::span<const Stage> stages);

/// The time after which they have ended at the latest, in time steps of the first.
double length_in_first_steps(std::span<const Stage> stages);

/// "nlgs, 12 subdomains, 2 threads, seed 1"; of the last three only those in which `all` differ.
std::string label_of(const StudyVariant& variant, std::span<const StudyVariant> all);

/// Solves faster than this are timed three times [s].
inline constexpr double cheap_solve = 2;

}  // namespace talus
