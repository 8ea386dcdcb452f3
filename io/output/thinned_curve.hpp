#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "runtime/step/frame.hpp"

namespace talus::io {

/// At most 2 x `capacity` rows of one stage, evenly spread over it, however long it lasts: when full, every
/// second row is dropped and only every second one is taken from then on. For drawing.
class ThinnedCurve {
 public:
  explicit ThinnedCurve(std::size_t capacity = 1000) : capacity_(capacity) {}
  /// A row of another stage than the last one begins a new curve.
  void add(const TriaxialReport& report);
  /// The rows kept, and the newest one in any case.
  std::vector<TriaxialReport> rows() const;
  bool empty() const { return !newest_; }

 private:
  std::size_t capacity_;
  std::size_t stride_ = 1, count_ = 0;
  std::vector<TriaxialReport> kept_;
  std::optional<TriaxialReport> newest_;
};

}  // namespace talus::io
