#pragma once

namespace talus {

/// Exit codes of the command, as batch systems and scripts expect them (docs/formats.md).
enum ExitCode : int {
  exit_done = 0,
  exit_failure = 1,           ///< the run broke off: runaway state, a failed task, a file that cannot be
                              ///< written, a dump that was asked for and not made
  exit_bad_input = 2,         ///< scene, option or input file; nothing was written
  exit_tolerance_missed = 3,  ///< finished, but a step or problem is over its tolerance
  exit_stopped = 75,  ///< stopped by a signal or a limit, behind a checkpoint: --resume goes on from there;
                      ///< or before the first step, with nothing written.
                      ///< EX_TEMPFAIL of sysexits.h: "the user is invited to retry"
};

}  // namespace talus
