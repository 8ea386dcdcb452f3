#pragma once

#include <span>
#include <vector>

#include "kernels/sweeps/momentum.hpp"
#include "kernels/sweeps/sweep_kernels.hpp"
#include "runtime/step/courses.hpp"
#include "runtime/step/epoch_schedule.hpp"
#include "runtime/step/state.hpp"

namespace talus {

/// What an epoch does to one chunk: it makes velocities afresh, measures errors, sweeps, or restores
/// impulses.
/// Chunks that share no body they write may be worked on at the same time.
class ChunkWork {
 public:
  /// Keeps references.
  ChunkWork(StepState& state, const StepParameters& parameters, const SweepKernels& kernels,
            const EpochSchedule& schedule, const Courses& courses);

  /// To be called when the chunks are new. `timed`: from now on the time of work on each chunk is added up.
  void plan(bool timed) { busy_.assign(timed ? state_.chunks.size() : 0, 0.0); }
  /// Before the first epoch of a step. `damped`: only a part of what a sweep changes at the interface is kept
  /// (damped Schwarz). `keep_impulses`: the impulses of each check are stored with the candidates, as sweeps
  /// go on before the result of the check is known.
  void begin(bool damped, bool keep_impulses);
  /// At a gate: allocates the history that the present course of sweeps needs.
  void make_room();
  /// Between steps: gives that memory back; make_room() takes it anew.
  void release_room();

  void run(std::size_t c, int epoch);
  /// At a gate, before a remedy that begins from the last check: brings back the impulses of that check.
  void restore();

  /// Whether this epoch is a sweep in single precision.
  bool single(int epoch) const {
    return schedule_.work(epoch) == EpochSchedule::Work::sweep && course(epoch).single;
  }
  /// Whether the sweep before this one, in this step, was in single precision.
  bool single_before(int epoch) const { return schedule_.sweep(epoch) > 0 && course(epoch - 1).single; }
  const Course& course(int epoch) const { return courses_.of(schedule_.sweep(epoch)); }

  const std::vector<ErrorSums>& errors() const { return errors_; }  ///< per chunk, of the last measure
  /// Likewise the impulse of the contacts on a periodic cell [N s]; empty between walls.
  const std::vector<CellVelocity>& cell_impulses() const { return cell_impulses_; }
  /// Per chunk, with conjugate gradients: squared norm of the last sweep's change [J].
  const std::vector<double>& changes() const { return changes_; }
  /// Per subdomain here: time of its chunks since the plan [s]; zeros unless timed.
  std::vector<double> busy() const;
  const AccelerationHistory& acceleration() const { return acceleration_; }
  /// After the last sweep of a step, for sweeps of another kind: the next step remembers none of it.
  AccelerationHistory& lend_acceleration() { return acceleration_; }

  /// Contacts of a chunk, and the bodies that it is the first to write.
  ContactRange range_of(std::size_t c) const;
  std::span<const Slot> owned(std::size_t c) const;

 private:
  template <bool Friction>
  void work(std::size_t c, int epoch);
  template <bool Friction>
  void accumulate(std::size_t c, int epoch);
  template <bool Friction>
  void measure(std::size_t c);
  template <bool Friction>
  void sweep(std::size_t c, int epoch);
  void carry_on(std::size_t c, int epoch);
  void change_precision(std::size_t c, int epoch);
  void to_single(std::size_t c, int epoch, bool before);
  void to_double(std::size_t c, int epoch, bool before);
  ChunkFriction friction_of(std::size_t c) const;
  bool at_wall(std::size_t c) const { return state_.chunks.wall[c] >= 0; }
  /// Its contacts push a cell that follows a stress: walls stretch with that, and their contacts do not.
  bool stressed(std::size_t c) const { return !state_.cell.copies.empty() && !at_wall(c); }
  bool blocks(std::size_t c) const { return state_.chunks.kind[c] == ChunkKind::blocks; }

  StepState& state_;
  const StepParameters& parameters_;
  const SweepKernels& kernels_;
  const EpochSchedule& schedule_;
  const Courses& courses_;
  bool keep_impulses_ = false;
  std::vector<ErrorSums> errors_;
  std::vector<CellVelocity> cell_impulses_;
  std::vector<std::vector<double>> before_;  ///< damped: per chunk at the interface, impulses before a sweep
  AccelerationHistory acceleration_;         ///< empty with plain sweeps
  std::vector<double> changes_;
  std::vector<double> busy_;  ///< per chunk [s]; empty unless timed
};

}  // namespace talus
