#pragma once

#include <exception>
#include <string>

#include "io/files/error.hpp"
#include "runtime/graph/communicator.hpp"

namespace talus::io::detail {

/// Runs `work` where `mine`; collective. All ranks throw when it fails on one, that one what it threw and the
/// others a FileError of `file`: nobody waits for a rank that has given up.
template <class Work>
void all_or_none(const graph::Communicator& ranks, const std::string& file, bool mine, const Work& work) {
  std::exception_ptr failure;
  try {
    if (mine) work();
  } catch (...) {
    failure = std::current_exception();
  }
  double failed[1] = {failure ? 1.0 : 0.0};
  ranks.max(failed);
  if (failure) std::rethrow_exception(failure);
  if (failed[0] > 0) throw FileError(file, "another rank could not write its part");
}

}  // namespace talus::io::detail
