#pragma once

/// How far one of several methods that work on the same problem has come, and what it has spent.

#include <cmath>
#include <limits>
#include <vector>

namespace talus::detail {

class OwnError {
 public:
  /// Begins, or begins anew, from a result of this error. Work goes on being counted.
  void begin(double error) {
    records_.assign(1, {work_, error});
    least_ = error;
  }
  void spend(double multiplications) { work_ += multiplications; }
  /// The error of the latest result.
  void check(double error) {
    if (error < least_) records_.push_back({work_, least_ = error});
  }
  double work() const { return work_; }
  /// Since it began.
  double least() const { return least_; }
  double work_since_begin() const { return work_ - records_.front().work; }
  /// Since the least error was found.
  double work_since_least() const { return work_ - records_.back().work; }
  /// Work until `tolerance`, should the logarithm of the least error go on falling as it has in the later
  /// half of the work since it began: infinite where it has not fallen.
  double remaining(double tolerance) const {
    if (least_ <= tolerance) return 0;
    const double half = 0.5 * work_since_begin(), from = work_ - half;
    double before = records_.front().error;
    for (auto record = records_.rbegin(); record != records_.rend(); ++record)
      if (record->work <= from) {
        before = record->error;
        break;
      }
    const double fallen = std::log(before / least_);
    return fallen > 0 ? std::log(least_ / tolerance) / fallen * half
                      : std::numeric_limits<double>::infinity();
  }

 private:
  struct Record {
    double work, error;
  };
  std::vector<Record> records_ = {{0, std::numeric_limits<double>::infinity()}};  ///< falling errors
  double work_ = 0, least_ = std::numeric_limits<double>::infinity();
};

}  // namespace talus::detail
