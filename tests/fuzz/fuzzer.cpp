/// The entry of libFuzzer, compiled once for each target, TALUS_FUZZ_TARGET.

#include "tests/fuzz/targets.hpp"

#ifdef TALUS_FUZZ_TARGET
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  talus::fuzz::TALUS_FUZZ_TARGET({data, size});
  return 0;
}
#endif
