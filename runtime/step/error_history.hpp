#pragma once

#include <cstddef>
#include <vector>

namespace talus {

/// A check of a step: the error after so many sweeps.
struct ErrorCheck {
  int iterations = 0;    ///< sweeps done
  double error_rms = 0;  ///< certificate.hpp
  double seconds = 0;    ///< sweeps and checks since the iterations of the step began
};

/// The checks of a step, in their order. ADMM is a new start: what came before it says nothing of how the
/// error goes on, so trends are those of the checks since.
class ErrorHistory {
 public:
  void clear();
  void add(const ErrorCheck& check) { checks_.push_back(check); }
  /// The next check is the first of a new start.
  void start_anew() { start_ = checks_.size(); }
  /// Patience counts from the last check.
  void be_patient() { patience_from_ = checks_.size() - 1; }

  const std::vector<ErrorCheck>& all() const { return checks_; }
  bool empty() const { return checks_.empty(); }
  std::size_t size() const { return checks_.size(); }
  const ErrorCheck& operator[](std::size_t k) const { return checks_[k]; }
  const ErrorCheck& last() const { return checks_.back(); }
  std::size_t start() const { return start_; }
  bool first_since_start() const { return checks_.size() == start_ + 1; }

  /// The last check at least `apart` sweeps before the newest one, as errors of neighbouring sweeps go up and
  /// down. Null if that was made before sweep number `begun`, or before the start.
  const ErrorCheck* before_last(int begun, int apart) const;
  /// Index of the last check at or before iterations/part of the newest, or of the first since the start.
  std::size_t last_in(int part) const;
  /// Whether sweeps stagnate: there were at least `patience`, and the best error of their second half is
  /// neither below `tolerance` nor below `gain` times the best one of the quarter before.
  bool stagnant(double tolerance, int patience, double gain) const;

 private:
  std::vector<ErrorCheck> checks_;
  std::size_t start_ = 0;
  std::size_t patience_from_ = 0;
};

}  // namespace talus
