#pragma once

/// Runs one scene of the stability study and judges it.

#include <array>

#include "apps/study_stability/stability_scenes.hpp"

namespace talus::stability {

/// What a scene came to. Trivially copyable: it comes out of another process through a pipe.
///
/// The bound of a certified step is twice what its certificate says (the larger of error_rms and balance),
/// but at least twice the tolerance asked for, below which nothing is claimed; with TruthFrom::rest
/// the step's distance from rest is added, in momentum over the impulse of the loads. Energy goes with the
/// square of velocities: without Newton's restitution and correction of overlaps a step may gain twice that
/// bound of what it would have without contacts.
struct Outcome {
  Verdict verdict = Verdict::failed;
  int steps = 0, judged = 0;  ///< done; certified and compared with a truth
  int missed = 0;             ///< not converged
  int iterations = 0;         ///< of all steps
  /// Of the step whose true error is largest against its bound; of the last one when no truth is known.
  double true_error = -1;  ///< < 0: not known
  double error_rms = 0, balance = 0;
  double energy_gained = 0;  ///< largest gain of a step that no load supplied, over the kinetic energy that
                             ///< the step would reach without contacts
  double penetration = 0;    ///< largest overlap over the smallest radius, over the run
  double seconds = 0;        ///< of the steps
  std::array<char, 400> why{};  ///< for verdicts that need it, one line
};

struct RunSettings {
  SolverMethod method = SolverMethod::automatic;  ///< replaces the scene's unless automatic
  double tolerance = 0;                           ///< > 0: of error_rms; on balance 50 times as much
  double seconds = 30;                            ///< a scene is stopped between two steps after so many
};

/// Whether the verdict is one that the scene's table expects. With a method or tolerance of one's own
/// anything goes that is neither wrong nor failed.
bool as_expected(const Scene& scene, const Outcome& outcome, const RunSettings& settings);

/// In this process. Throws nothing.
Outcome run_scene(const Scene& scene, const RunSettings& settings);

/// In a process of its own, so that a crash or a hang (twice the seconds, and 10 more) is a row like any
/// other. No thread may be running. Throws std::runtime_error when the system grants no process.
Outcome run_scene_apart(const Scene& scene, const RunSettings& settings);

}  // namespace talus::stability
