#pragma once

/// Threads that would only wait help one thread with its work. In an epoch loop (epoch_loop.hpp) these are
/// the threads that wait at a gate; the thread that decides there shares its work with them.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>

#include "runtime/graph/worker.hpp"

namespace talus::graph {

/// One atomic word holds the number of pieces and the index of the next one. A thread takes a piece by a
/// compare-and-exchange that increments the index, so each piece is done exactly once. Help is optional: a
/// thread that comes late finds no piece left. Sharing pays for pieces of a few microseconds or more.
class Crew {
 public:
  /// Calls work(k) for each k < count < 2^32, on this thread and on those that help, in any order and at the
  /// same time; returns when all are done. Only one thread may call it at a time. If pieces throw, one of
  /// their exceptions is rethrown here after all pieces have ended.
  void share(std::size_t count, const std::function<void(std::size_t)>& work);

  /// Takes pieces while there are any. Any thread may call it, at any time.
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
  std::exception_ptr failure_;  ///< written by the thread that set `failed_`
};

}  // namespace talus::graph
