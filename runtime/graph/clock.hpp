#pragma once

/// The clock by which a run times itself.

#include <chrono>

namespace talus::graph {

#ifdef TALUS_SMPI
/// Ranks are simulated (SimGrid's SMPI): all of them are in one process, one runs at a time, and MPI's clock
/// is that of the machine that is simulated.
inline constexpr bool simulated_ranks = true;

/// Time of the simulated machine: what ranks have computed, as measured, and what messages took, as modelled.
/// The clocks of the standard library measure the time that the simulation itself takes.
struct Clock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<Clock>;
  static constexpr bool is_steady = true;
  static time_point now() noexcept;
};

/// While an object of this class lives, the rank's work takes `seconds` on the simulated machine, whatever
/// the host needs for it. The time passes before the first message that the rank sends meanwhile, or at the
/// end of the object's life if it sends none; messages that it takes before are taken without this delay.
/// The times of nested objects add up.
class GivenTime {
 public:
  explicit GivenTime(double seconds);
  ~GivenTime();
  GivenTime(const GivenTime&) = delete;
  GivenTime& operator=(const GivenTime&) = delete;

 private:
  double around_ = 0;  ///< time of the enclosing GivenTime that has not passed yet [s]
};
#else
inline constexpr bool simulated_ranks = false;
using Clock = std::chrono::steady_clock;

/// On real ranks the work takes its own time, whatever `seconds` says.
struct GivenTime {
  explicit GivenTime(double /*seconds*/) {}
};
#endif

/// [s] since some moment that is the same for the whole run.
inline double seconds_now() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

}  // namespace talus::graph
