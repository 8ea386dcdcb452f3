#pragma once

/// The line that tells how far a run is.

#include <chrono>
#include <cstdio>
#include <optional>
#include <string>

#include "runtime/step/frame.hpp"

namespace talus::io {

/// E.g. "shear  34 %  step 1234  t 12.3 ms  6012 contacts  45 it  err 8.2e-04  ETA 1:23"; a step that missed
/// its tolerance shows as "err 8.2e-04 MISSED". `eta` in seconds, none while it is not known.
std::string progress_line(const StepReport& report, const std::string& stage, double fraction,
                          std::optional<double> eta);

/// Shows the progress on a stream: on a terminal one line that is rewritten at most 5 times a second;
/// elsewhere plain lines at most every 10 s, the first and the last in any case. One thread at a time. What
/// the stream does not take is dropped.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  /// `columns`: longest line of a terminal, longer ones are cut, since they could not be rewritten.
  Progress(std::FILE* stream, bool terminal, std::size_t columns);

  /// `fraction` of the stage that is done, in [0, 1]; the time left is estimated from this stage alone, since
  /// stages differ.
  void update(const StepReport& report, const std::string& stage, double fraction,
              Clock::time_point now = Clock::now());

  /// Shows the last step if update() held it back, and ends the line. Other output may follow.
  void finish();

 private:
  void show();

  std::FILE* stream_;
  bool terminal_;
  std::size_t columns_;
  std::string line_;   ///< of the last update
  bool shown_ = true;  ///< line_ has been written
  bool open_ = false;  ///< the cursor stands in a rewritten line
  std::optional<Clock::time_point> last_shown_;
  std::string stage_;
  std::optional<Clock::time_point> stage_begin_;
  double stage_begin_fraction_ = 0;
};

/// Progress on stderr, as a terminal or a file, whichever it is.
Progress progress_on_stderr();

}  // namespace talus::io
