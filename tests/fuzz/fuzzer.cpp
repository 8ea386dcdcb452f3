/// The entry of libFuzzer, compiled once for each target, TALUS_FUZZ_TARGET.

#include "io/files/detail/rehearsal.hpp"
#include "tests/fuzz/targets.hpp"

#ifdef TALUS_FUZZ_TARGET
/// libFuzzer's own processes do as children, and ten times as fast: README.md.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  talus::io::detail::this_process_may_die = true;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  talus::fuzz::TALUS_FUZZ_TARGET({data, size});
  return 0;
}
#endif
