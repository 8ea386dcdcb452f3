#pragma once

#include <cstdint>

namespace talus {

/// When the velocity error that was found for a work of errors may be used for another problem.
struct VelocityErrorReuse {
  /// The error is taken for so many times what it was per work, >= 1: the next may be worse.
  double caution = 2;
  /// Relative error of velocities per relative work of errors: at least, > 0, and at most, also where nothing
  /// was found. Of 62 steps of large clusters that were wrong by more than twice their claim, 58 had an error
  /// of at most 10 times the work (docs/certificate.md).
  double least = 1, most = 10;
  /// A check of the velocities that finds less than this much per work is not believed, in [0, `least`].
  double credible = 0.1;
  /// Both with friction, > 0: contacts that slide do work that nobody's velocity lacks, and the linear solve
  /// knows less of them. In the shear of the demo checks find 0.1 to 0.3; in flat vaults, where 0.2 to 0.6
  /// would be right, a hundredth.
  double least_sliding = 0.3;
  /// So many times the work with friction an error is told to be (of wall forces, too: Certificate), as far
  /// as the tolerance goes unless the user has set it, >= `least_sliding`: no step is missed for it, but of
  /// 110 certified steps of beds on a belt and on a floor that turns, 3 were wrong by more than twice their
  /// work, the worst by 2.9.
  double told_sliding = 2;
  /// What was found is used while the number of contacts changes by at most this fraction, one in so many, >=
  /// 1, and the energy that they exchange by at most this factor, > 1.
  std::int64_t same_contacts = 10;
  double same_energy = 4;
  /// A velocity check costs as much as some hundred sweeps: the next one comes no earlier than so many sweeps
  /// later, >= 0.
  std::int64_t sweeps_between = 10000;
};

/// How large an error of velocities belongs to the work of the contacts' errors (ErrorSums::work, over the
/// energy that contacts exchange), which every check knows: found now and then by a check of the velocities
/// as a whole, and kept for later steps.
class VelocityErrorMemory {
 public:
  /// What the answer depends on.
  struct Problem {
    std::int64_t contacts = 0;
    double exchanged = 0;  ///< [J]
  };

  explicit VelocityErrorMemory(const VelocityErrorReuse& reuse = {}) : reuse_(reuse) {}

  /// The relative error of velocities to be expected, per relative work of errors.
  double per_work(const Problem& problem, bool friction) const;
  /// What an answer is at least, per work.
  double credible(bool friction) const { return friction ? reuse_.least_sliding : reuse_.credible; }
  /// Enough sweeps were done since the last check, or there was none.
  bool due() const { return sweeps_ < 0 || sweeps_ >= reuse_.sweeps_between; }
  /// A check has found this error of velocities with this work of errors, both relative.
  void found(const Problem& problem, double error, double work);
  /// A step has ended after so many sweeps.
  void swept(int sweeps) {
    if (sweeps_ >= 0) sweeps_ += sweeps;
  }
  const VelocityErrorReuse& reuse() const { return reuse_; }

  /// visit(name, member) for each member of a state, which may be const.
  template <class Memory, class Visit>
  static void each_number(Memory& memory, const Visit& visit) {
    visit("velocity_error", memory.last_);
    visit("velocity_error_before", memory.before_);
    visit("velocity_error_contacts", memory.problem_.contacts);
    visit("velocity_error_exchanged", memory.problem_.exchanged);
    visit("velocity_error_sweeps", memory.sweeps_);
  }

 private:
  VelocityErrorReuse reuse_;
  double last_ = 0, before_ = 0;  ///< errors per work, of the last two checks
  Problem problem_;               ///< of the last
  std::int64_t sweeps_ = -1;      ///< since; -1: there was none
};

}  // namespace talus
