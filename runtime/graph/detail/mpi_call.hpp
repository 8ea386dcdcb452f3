#pragma once

namespace talus::graph::detail {

/// Operations per second that a platform of SMPI has to name for a core as fast as the host's.
inline constexpr double host_flops = 1e9;

#ifdef TALUS_SMPI
/// Around calls of MPI on simulated ranks: what the rank has computed since it left the last one passes on
/// the simulated machine, by a clock that is read in 20 ns, or by the thread's processor time where that is
/// less: the host was busy elsewhere. SMPI would do that by processor time alone, 0.6 us a reading, which is
/// as much as the chunks between two messages; so the platform tells it not to (io::smpi_platform). May be
/// nested; the outermost counts.
class MpiCall {
 public:
  /// `takes`: takes a message and sends none, so that a time that is given (graph::GivenTime) is still to
  /// come.
  explicit MpiCall(bool takes = false);
  ~MpiCall();
  MpiCall(const MpiCall&) = delete;
  MpiCall& operator=(const MpiCall&) = delete;
  /// What came before counts for nothing: the rank starts here.
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
