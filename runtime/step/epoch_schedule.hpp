#pragma once

namespace talus {

/// Which epoch of a step's loop does what. Epochs and sweeps count from 0 in each step.
///
///   epoch   s            s+1               s+2 ... s+1+n   s+2+n        s+3+n
///           accumulate   measure -> gate   n sweeps        accumulate   measure -> gate ...
///
/// A segment is the sweeps between two checks, with the accumulate and the measure that follow them; the
/// first segment of a step has no sweeps. `accumulate` makes velocities afresh from the impulses: the error
/// is thus never that of velocities that have drifted from the impulses, and the step ends with the
/// velocities that were certified.
///
/// With several ranks the sums of a check travel during the next sweep and are read after it. If they say
/// that the step is solved, `restore` brings back the impulses that were certified.
///
/// If overlaps are to be undone, the epochs of positions_from() follow, however the iterations have ended.
///
///   after measure, sums known:     sweep_on(epoch, n), again_from(epoch), or the loop ends
///   after measure, sums under way: sweep_on(epoch, n); read_sums_after_next(epoch)
///   after the epoch that reads:    stretch(n), again_from(epoch), or restore_after(epoch)
class EpochSchedule {
 public:
  enum class Work { accumulate, measure, sweep, restore, position };

  Work work(int epoch) const {
    return position_end_ != never && epoch >= position_end_ - positions_ ? Work::position
           : epoch == restore_at_                                        ? Work::restore
           : epoch < segment_                                            ? Work::sweep
           : epoch == segment_                                           ? Work::accumulate
                                                                         : Work::measure;
  }
  /// Number of the sweep of this epoch among those of the step.
  int sweep(int epoch) const { return checked_ + epoch - first_sweep_; }
  /// Whether this epoch is the first of its segment, hence follows an accumulate and a measure.
  bool opens_segment(int epoch) const { return epoch == first_sweep_; }
  bool closes_segment(int epoch) const { return epoch + 1 == segment_; }
  /// Sweeps of the segment up to this epoch, with it.
  int sweeps_of_segment(int epoch) const { return epoch - first_sweep_ + 1; }

  bool measures_at(int epoch) const { return epoch == segment_ + 1; }
  bool reads_sums_at(int epoch) const { return epoch == read_at_; }
  bool restores_at(int epoch) const { return epoch == restore_at_; }
  /// Number, from 0, of an epoch of positions; and whether the loop ends after it.
  int position_epoch(int epoch) const { return epoch - (position_end_ - positions_); }
  bool ends_at(int epoch) const { return epoch + 1 == position_end_; }

  /// Sweeps done at the last measure, and at the next accumulate.
  int checked() const { return checked_; }
  int planned() const { return planned_; }

  // At gates only, when every thread waits:

  /// The sweeps of the segment are done and measured.
  void measured() { checked_ = planned_; }
  /// After the measure of this epoch: `sweeps` more.
  void sweep_on(int epoch, int sweeps) {
    first_sweep_ = epoch + 1;
    stretch(sweeps);
  }
  /// Sets the number of sweeps of the present segment, those already done included.
  void stretch(int sweeps) {
    planned_ = checked_ + sweeps;
    segment_ = first_sweep_ + sweeps;
  }
  /// The impulses of the last measure were replaced: accumulate follows.
  void again_from(int epoch) { sweep_on(epoch, 0); }
  void read_sums_after_next(int epoch) { read_at_ = epoch + 1; }
  void sums_read() { read_at_ = never; }
  /// The step ends after the next epoch, with the impulses of the last measure.
  void restore_after(int epoch) { restore_at_ = epoch + 1; }
  /// The velocities are final: `epochs` >= 1 that undo overlaps follow, then the loop ends.
  void positions_from(int epoch, int epochs) {
    *this = {};
    segment_ = first_sweep_ = never - 1;
    positions_ = epochs;
    position_end_ = epoch + 1 + epochs;
  }

 private:
  static constexpr int never = -1;
  int first_sweep_ = 0;  ///< epoch of the first sweep of the segment
  int segment_ = 0;      ///< epoch of the next accumulate
  int read_at_ = never;
  int restore_at_ = never;
  int checked_ = 0;
  int planned_ = 0;
  int position_end_ = never;  ///< epoch after the last one of positions
  int positions_ = 0;
};

}  // namespace talus
