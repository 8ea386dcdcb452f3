#include "io/output/thinned_curve.hpp"

namespace talus::io {

void ThinnedCurve::add(const TriaxialReport& report) {
  if (newest_ && newest_->stage != report.stage) *this = ThinnedCurve(capacity_);
  newest_ = report;
  if (count_++ % stride_ != 0) return;
  kept_.push_back(report);
  if (kept_.size() < 2 * capacity_) return;
  for (std::size_t k = 0; 2 * k < kept_.size(); ++k) kept_[k] = kept_[2 * k];
  kept_.resize((kept_.size() + 1) / 2);
  stride_ *= 2;
}

std::vector<TriaxialReport> ThinnedCurve::rows() const {
  std::vector<TriaxialReport> rows = kept_;
  if (newest_ && (rows.empty() || rows.back().step != newest_->step)) rows.push_back(*newest_);
  return rows;
}

}  // namespace talus::io
