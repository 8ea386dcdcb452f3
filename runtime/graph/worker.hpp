#pragma once

/// What one thread of a team knows of the run it takes part in, and how it waits for the others.

#include <atomic>
#include <cstdint>
#include <thread>

#include "runtime/graph/detail/splitmix.hpp"

namespace talus::graph {

/// Bytes that two threads must not both write to: one line of the caches of x86 and of most ARM processors.
inline constexpr std::size_t cache_line = 64;

/// Raised once by the first failure of a run and seen by every loop that waits.
/// Written by the thread whose task failed, read by all. Relaxed is enough: the flag carries no data, it only
/// ends waiting; the failure itself travels under the executor's mutex.
class StopFlag {
 public:
  void raise() noexcept { raised_.store(true, std::memory_order_relaxed); }
  void lower() noexcept { raised_.store(false, std::memory_order_relaxed); }
  bool raised() const noexcept { return raised_.load(std::memory_order_relaxed); }

 private:
  alignas(cache_line) std::atomic<bool> raised_{false};
};

/// Tells the core that this thread polls: frees the other hyper-thread and keeps the exit from the loop
/// cheap.
inline void pause() noexcept {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield" ::: "memory");
#endif
}

/// Polls before a thread that waits offers its core to others: some 100 microseconds of a Xeon (Sapphire
/// Rapids), which is longer than a thread waits for a neighbour that has a core of its own. Where other
/// programs want the cores, an offer is taken for milliseconds: with 128 polls two threads beside two other
/// programs on two cores took 6 times as long (60 steps of the demo, 12.4 s for 2.1). Four threads on these
/// cores took as long with either.
inline constexpr int polls_before_yield = 2048;

/// Pseudo-random spinning, to shake the order in which threads meet (test executors only). Mostly under a
/// microsecond, now and then long enough for another thread to pass many tasks, now and then a hand-over of
/// the core.
class Delay {
 public:
  /// Every thread of a run draws from a sequence of its own.
  Delay(std::uint64_t seed, int thread) noexcept
      : state_(seed * 0x9e3779b97f4a7c15ULL + static_cast<std::uint64_t>(thread) * 0xd1342543de82ef95ULL) {}

  void operator()() noexcept {
    const std::uint64_t draw = detail::scatter(state_ += 0x9e3779b97f4a7c15ULL);
    const std::uint64_t kind = draw & 31;
    if (kind == 0) std::this_thread::yield();
    const std::uint64_t spins = (draw >> 8) % (kind == 1 ? 2048 : 32);
    for (std::uint64_t i = 0; i < spins; ++i) pause();
  }

 private:
  std::uint64_t state_;
};

/// One thread's place in a team task. Lives on that thread's stack, for one run.
class Worker {
 public:
  /// `stop` outlives the worker. `delay_seed` 0: no delays.
  Worker(int thread, int threads, const StopFlag& stop, std::uint64_t delay_seed = 0) noexcept
      : thread_(thread),
        threads_(threads),
        stop_(&stop),
        delayed_(delay_seed != 0),
        delay_(delay_seed, thread) {}

  int thread() const noexcept { return thread_; }    ///< 0 .. threads() - 1
  int threads() const noexcept { return threads_; }  ///< size of the team

  /// True once a task of the run has failed, on any thread: whoever waits for another thread must leave.
  bool stopped() const noexcept { return stop_->raised(); }

  /// Test executors spin here; all others pass.
  void delay() noexcept {
    if (delayed_) delay_();
  }

  /// Polls until `ready()` is true; false if the run was stopped first. Spins for a while, then offers the
  /// core at every poll, because the thread it waits for may need this very core.
  template <class Ready>
  bool wait(Ready ready) const {
    for (int spin = 0; spin < polls_before_yield; ++spin) {
      if (ready()) return true;
      pause();
    }
    while (!ready()) {
      if (stopped()) return false;
      std::this_thread::yield();
    }
    return true;
  }

 private:
  int thread_;
  int threads_;
  const StopFlag* stop_;
  bool delayed_;
  Delay delay_;
};

}  // namespace talus::graph
