#pragma once

/// Several ranks in one process: threads that meet in each reduction.

#include <algorithm>
#include <barrier>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <span>
#include <thread>
#include <vector>

#include "partition/reduction.hpp"

namespace talus::test {

/// Calls work(rank, reduction) for each rank, all at the same time. Rethrows the error of the lowest rank;
/// an error must come to all ranks, as it does with MPI.
template <class Work>
void on_pretend_ranks(std::size_t ranks, Work&& work) {
  std::barrier meet(static_cast<std::ptrdiff_t>(ranks));
  std::vector<void*> values(ranks);
  std::vector<std::exception_ptr> errors(ranks);
  const auto reduce = [&](std::size_t rank, auto span, auto combine) {
    using Value = typename decltype(span)::value_type;
    values[rank] = span.data();
    meet.arrive_and_wait();
    std::vector<Value> result(span.begin(), span.end());
    for (std::size_t other = 0; other < ranks; ++other)
      for (std::size_t k = 0; k < span.size() && other != rank; ++k)
        result[k] = combine(result[k], static_cast<const Value*>(values[other])[k]);
    meet.arrive_and_wait();
    std::copy(result.begin(), result.end(), span.begin());
  };
  std::vector<std::thread> threads;
  for (std::size_t rank = 0; rank < ranks; ++rank)
    threads.emplace_back([&, rank] {
      Reduction reduction;
      reduction.first = rank == 0;
      reduction.sum = [&reduce, rank](std::span<std::int64_t> span) {
        reduce(rank, span, [](std::int64_t a, std::int64_t b) { return a + b; });
      };
      reduction.max = [&reduce, rank](std::span<double> span) {
        reduce(rank, span, [](double a, double b) { return a > b ? a : b; });
      };
      try {
        work(rank, static_cast<const Reduction&>(reduction));
      } catch (...) {
        errors[rank] = std::current_exception();
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (const auto& error : errors)
    if (error) std::rethrow_exception(error);
}

}  // namespace talus::test
