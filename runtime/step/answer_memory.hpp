#pragma once

#include <algorithm>
#include <cstdint>

namespace talus {

/// How long answers of small clusters are looked for where earlier steps found none.
struct AnswerPatience {
  /// What an answer may cost grows with the sweeps of the step (ClusterThresholds::budget_per_sweep). Behind
  /// each step in a row that ended without one so many of them count as one more, up to `most`, >= 1: jammed
  /// grains stay jammed, and the steps of such a scene took a hundred times as long as others and were missed
  /// nevertheless.
  std::int64_t growth = 2, most = 16;
  /// Then, behind so many such steps, all of them count again, once, >= 1.
  std::int64_t again = 20;
};

/// Which of the last steps ended without an answer.
class AnswerMemory {
 public:
  explicit AnswerMemory(const AnswerPatience& patience = {}) : patience_(patience) {}

  /// Of the sweeps that a step has had, those that its answers may cost.
  int credited(int sweeps) const {
    std::int64_t part = 1;
    for (std::int64_t k = 0; k < unanswered_ % patience_.again && part < patience_.most; ++k)
      part *= patience_.growth;
    return static_cast<int>(sweeps / std::min(part, patience_.most));
  }
  /// A step has ended.
  void ended(bool unanswered) { unanswered_ = unanswered ? unanswered_ + 1 : 0; }

  /// visit(name, member) for each member of a state, which may be const.
  template <class Memory, class Visit>
  static void each_number(Memory& memory, const Visit& visit) {
    visit("unanswered_steps", memory.unanswered_);
  }

 private:
  AnswerPatience patience_;
  std::int64_t unanswered_ = 0;  ///< steps in a row
};

}  // namespace talus
