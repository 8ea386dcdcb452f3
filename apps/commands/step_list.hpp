#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace talus {

/// Steps as the command line names them: "7", "10:20" (both ends are in it), "1,5,100:120".
class StepList {
 public:
  /// No step.
  StepList() = default;
  /// Throws std::invalid_argument, naming the part, unless every part is a step >= 1 or a range that does not
  /// run backwards.
  explicit StepList(const std::string& text);

  bool empty() const { return ranges_.empty(); }
  bool contains(std::int64_t step) const;
  /// The largest step in it; 0 when it is empty.
  std::int64_t last() const;

 private:
  std::vector<std::pair<std::int64_t, std::int64_t>> ranges_;
};

}  // namespace talus
