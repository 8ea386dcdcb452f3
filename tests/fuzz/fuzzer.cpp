/// The entry of libFuzzer, compiled once for each target, TALUS_FUZZ_TARGET.

#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <vector>

#include "tests/fuzz/targets.hpp"

#ifdef TALUS_FUZZ_TARGET
/// Where clang counts what code was reached; the linker names the ends.
extern "C" std::uint8_t __start___sancov_cntrs[], __stop___sancov_cntrs[];

/// Readers that try a file in a child process reach their code there, and libFuzzer looks here: the counters
/// become memory that both share, but for those on the two pages that hold other things as well.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(__start___sancov_cntrs) + page - 1) / page * page;
  const auto end = reinterpret_cast<std::uintptr_t>(__stop___sancov_cntrs) / page * page;
  if (begin >= end) return 0;
  auto* const counters = reinterpret_cast<std::uint8_t*>(begin);
  const std::vector<std::uint8_t> before(counters, counters + (end - begin));
  ::mmap(counters, end - begin, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
  std::memcpy(counters, before.data(), before.size());
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  talus::fuzz::TALUS_FUZZ_TARGET({data, size});
  return 0;
}
#endif
