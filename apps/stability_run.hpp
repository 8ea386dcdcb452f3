#pragma once

/// Runs one scene of the stability study and judges it.

#include <array>
#include <string_view>

#include "apps/stability_scenes.hpp"

namespace talus::stability {

/// The bound of a certified step is twice what its certificate says (the larger of error_rms and balance),
/// but at least twice the tolerance asked for, below which nothing is claimed. Where the truth holds for a
/// sample at rest, the certificate of the step before is added: what that left over must be stopped in this
/// one.
enum class Verdict {
  right,      ///< every step certified, and the true error is within its bound
  certified,  ///< every step certified, the truth is not known
  honest,     ///< some step missed its tolerance, or time ran out, and it says so
  refused,    ///< an error that names its cause
  wrong,      ///< a step is certified, and its true error is beyond its bound
  failed,     ///< not a number, an unforeseen error, a crash or a hang
};
std::string_view name_of(Verdict verdict);

/// What a scene came to. Trivially copyable: it comes out of another process through a pipe.
struct Outcome {
  Verdict verdict = Verdict::failed;
  int steps = 0, missed = 0;  ///< done, and not converged
  int iterations = 0;         ///< of all steps
  /// Of the step whose true error is largest against its certificate; of the last one when no truth is known.
  double true_error = -1;  ///< < 0: not known
  double error_rms = 0, balance = 0;
  double energy_gained = 0;     ///< largest gain over the run that no load supplied, over the largest kinetic
                                ///< energy that a step would reach without contacts
  double penetration = 0;       ///< largest overlap over the smallest radius, over the run
  double seconds = 0;           ///< of the steps
  std::array<char, 400> why{};  ///< for verdicts that need it, one line
};

struct RunSettings {
  SolverMethod method = SolverMethod::automatic;  ///< replaces the scene's unless automatic
  double tolerance = 0;                           ///< > 0: of error_rms; on balance 50 times as much
  double seconds = 30;                            ///< a scene is stopped between two steps after so many
};

/// In this process. Throws nothing.
Outcome run_scene(const Scene& scene, const RunSettings& settings);

/// In a process of its own, so that a crash or a hang (twice the seconds, and 10 more) is a row like any
/// other. No thread may be running. Throws std::runtime_error when the system grants no process.
Outcome run_scene_apart(const Scene& scene, const RunSettings& settings);

}  // namespace talus::stability
