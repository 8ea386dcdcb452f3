#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

namespace talus::trace::detail {

/// Things that happen, in order of time, then of their making.
struct Event {
  double time;
  std::uint64_t order;
  std::uint32_t what, a, b;
  bool operator>(const Event& other) const {
    return time != other.time ? time > other.time : order > other.order;
  }
};
class Agenda {
 public:
  void add(double time, std::uint32_t what, std::uint32_t a, std::uint32_t b = 0) {
    events_.push({time, order_++, what, a, b});
  }
  bool empty() const { return events_.empty(); }
  Event next() {
    const Event event = events_.top();
    events_.pop();
    return event;
  }

 private:
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::uint64_t order_ = 0;
};

}  // namespace talus::trace::detail
