#include "runtime/graph/crew.hpp"

#include <stdexcept>
#include <thread>
#include <utility>

namespace talus::graph {

void Crew::share(std::size_t count, const std::function<void(std::size_t)>& work) {
  if (count >> 32 != 0) throw std::invalid_argument("Crew::share takes fewer than 2^32 pieces");
  work_ = &work;
  done_.store(0, std::memory_order_relaxed);
  // Release: a thread that reads this word also sees `work_`.
  next_.store(static_cast<std::uint64_t>(count) << 32, std::memory_order_release);
  help();
  // A helper adds its piece to done_ only after its last use of `work`.
  for (int polls = 0; done_.load(std::memory_order_acquire) < count; ++polls)
    if (polls < polls_before_yield)
      pause();
    else
      std::this_thread::yield();
  if (failed_.exchange(false, std::memory_order_relaxed)) std::rethrow_exception(std::exchange(failure_, {}));
}

bool Crew::take() noexcept {
  std::uint64_t now = next_.load(std::memory_order_acquire);
  do {
    if ((now & 0xffffffffU) >= now >> 32) return false;
  } while (!next_.compare_exchange_weak(now, now + 1, std::memory_order_acquire));
  // share() cannot return, and `work_` stays valid, until this thread has added its piece to done_.
  try {
    (*work_)(now & 0xffffffffU);
  } catch (...) {
    if (!failed_.exchange(true, std::memory_order_relaxed)) failure_ = std::current_exception();
  }
  done_.fetch_add(1, std::memory_order_release);
  return true;
}

}  // namespace talus::graph
