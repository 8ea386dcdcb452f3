#pragma once

/// Pieces of work that one thread shares with threads that would only wait for it: at a gate of an epoch loop
/// (epoch_loop.hpp) the thread that decides, and all others.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>

#include "runtime/graph/worker.hpp"

namespace talus::graph {

/// One word says what is left: the number of pieces, and the next to be taken. Whoever takes a piece moves
/// the word on by compare and exchange, so a piece is done once, and nobody has to come: a thread that is
/// late finds nothing. Pieces of a few microseconds and more are worth it.
class Crew {
 public:
  /// work(k) for each k < count < 2^32, by this thread and those that help, in any order and at the same
  /// time; returns when all are done. By one thread at a time. What a piece throws is thrown here once all
  /// are done, of several failures any.
  void share(std::size_t count, const std::function<void(std::size_t)>& work);

  /// Takes pieces while there are any; by any thread, at any time.
  void help() noexcept {
    while (take()) {
    }
  }

 private:
  bool take() noexcept;

  alignas(cache_line) std::atomic<std::uint64_t> next_{0};  ///< count in the upper half, index in the lower
  alignas(cache_line) std::atomic<std::size_t> done_{0};
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::atomic<bool> failed_{false};
  std::exception_ptr failure_;  ///< written by whoever raised `failed_`
};

}  // namespace talus::graph
