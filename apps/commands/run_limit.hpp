#pragma once

/// How long a run may go on.

#include <optional>
#include <string>

namespace talus {

/// Seconds of "3:50:00", "50:00" or "1-02:00:00" (days). Throws std::invalid_argument for anything else: a
/// number alone is minutes to some batch systems and seconds to others.
double parse_duration(const std::string& text);

/// Elapsed time that is left to this process: `given` [s] if any, and what the batch system grants it
/// (SLURM_JOB_END_TIME, seconds since 1970), whichever is less. None: no limit.
std::optional<double> time_granted(std::optional<double> given);

/// Whether there is time for one more step and what follows it.
class WallLimit {
 public:
  /// `end`: clock (graph::seconds_now) when the process must have ended.
  explicit WallLimit(std::optional<double> end) : end_(end) {}

  /// A step has taken so long [s]; a checkpoint; the output of a frame.
  void took_step(double seconds);
  void took_save(double seconds);
  void took_frame(double seconds);
  /// The clock is `now`, behind a step: the next one, twice as long as the longest of late, and a frame and a
  /// checkpoint, twice as long as any, would end too late. Before the first checkpoint the frame stands for
  /// it too, which has about as many bytes.
  bool reached(double now) const;

 private:
  std::optional<double> end_;
  double step_ = 0, save_ = 0, frame_ = 0;
};

}  // namespace talus
