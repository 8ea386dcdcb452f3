#pragma once

namespace talus::graph::detail {

/// Operations per second that a platform of SMPI has to name for a core as fast as the host's.
inline constexpr double host_flops = 1e9;

#ifdef TALUS_SMPI
/// Encloses calls of MPI on simulated ranks: advances the simulated clock by the rank's computing time since
/// it left the last such call. That time is taken from a clock that is read in 20 ns, or from the thread's
/// processor time if that is less, since then the host was busy elsewhere. SMPI itself would use processor
/// time alone, whose reading takes 0.6 us, as long as the chunks between two messages; so the platform
/// switches that off (io::smpi_platform). May be nested; the outermost counts.
class MpiCall {
 public:
  /// `takes`: the call receives a message and sends none, so a time that is given (graph::GivenTime) does not
  /// pass in it.
  explicit MpiCall(bool takes = false);
  ~MpiCall();
  MpiCall(const MpiCall&) = delete;
  MpiCall& operator=(const MpiCall&) = delete;
  /// Starts the rank's time: computing before this call does not count.
  static void begin_rank();
};
#else
/// Real ranks need nothing around calls of MPI.
struct MpiCall {
  explicit MpiCall(bool /*takes*/ = false) {}  // not trivial: an unused one is no oversight
  static void begin_rank() {}
};
#endif

}  // namespace talus::graph::detail
