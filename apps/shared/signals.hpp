#pragma once

/// What signals ask of a run or of a study. Handlers set flags, which these look at between two steps: the
/// one place of the program with global variables, since a handler has no other.

namespace talus {

/// From now on SIGTERM, SIGINT, SIGHUP and SIGXCPU ask for an end behind the present step, and the second of
/// them ends the process at once; SIGUSR1 asks for a checkpoint. SIGHUP that nohup has switched off stays so.
void catch_signals();

/// The signal that has asked to end, or 0.
int stop_signal();
/// SIGUSR1 has come since the last call.
bool save_was_asked();

/// "SIGTERM"; "a signal" for those that are not caught.
const char* signal_name(int signal);

}  // namespace talus
