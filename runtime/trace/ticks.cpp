#include "runtime/trace/ticks.hpp"

#include <fstream>
#include <limits>
#include <string>

namespace talus::trace {

#ifdef __x86_64__

namespace {

/// The system has checked that the counters of all cores agree.
bool system_counts() {
  std::ifstream file("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  std::string name;
  return file >> name && name == "tsc";
}

struct Reading {
  std::int64_t count;
  graph::Clock::time_point time;
};

/// Both at the same time: of some readings the one that nothing came between.
template <class Count>
Reading read_both(Count count) {
  Reading best{};
  auto shortest = std::numeric_limits<std::int64_t>::max();
  for (int k = 0; k < 32; ++k) {
    const std::int64_t before = count();
    const graph::Clock::time_point time = graph::Clock::now();
    const std::int64_t after = count();
    if (after - before >= shortest) continue;
    shortest = after - before;
    best = {before + shortest / 2, time};
  }
  return best;
}

}  // namespace

Ticks::Ticks() {
  if (graph::simulated_ranks || !system_counts()) return;
  const Reading first = read_both(count);
  while (graph::Clock::now() - first.time < std::chrono::milliseconds(1)) {
  }
  const Reading second = read_both(count);
  start_ = first.time;
  first_ = first.count;
  length_ = std::chrono::duration<double, std::nano>(second.time - first.time).count() /
            static_cast<double>(second.count - first.count);
}

#else

Ticks::Ticks() = default;

#endif

}  // namespace talus::trace
