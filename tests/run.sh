#!/usr/bin/env bash
# Every test: installs what is missing, checks the format of the sources, builds preset `release` (warnings are errors), runs ctest.
# Further arguments go to ctest, e.g. -L unit. With CI_LONG=1 the command is built for simulated ranks as well, whose tests are
# skipped otherwise; tests of units and of several ranks run again under the address and undefined-behaviour sanitizers, those of
# graph, executor, communicator and step under the thread sanitizer, in a build by clang; and the benchmarks are built, which no
# test runs. Exit code 0 only if all of it passed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source apps/setup.sh tests
status=0

# An archive without .git holds sources only, and may lie inside another checkout; `safe.directory`: a container may not own this one.
sources() {
  if [ -e .git ] && git -c safe.directory="$PWD" ls-files -z -- '*.cpp' '*.hpp' 2>/dev/null; then return; fi
  find kernels partition runtime io apps tests \( -name '*.cpp' -o -name '*.hpp' \) -print0 2>/dev/null
}
if sources | xargs -0 --no-run-if-empty clang-format --dry-run -Werror; then
  echo "format: clean"
else
  echo "format: run clang-format -i on the files above" >&2
  status=1
fi

if [ "${CI_LONG:-0}" = 1 ]; then
  cmake --preset smpi
  cmake --build --preset smpi
fi
cmake --preset release
cmake --build --preset release
if [ "${CI_LONG:-0}" = 1 ]; then cmake --build --preset release --target benches; fi
ctest --preset release -j2 "$@" || status=$?

if [ "${CI_LONG:-0}" = 1 ]; then
  cmake --preset asan
  cmake --build --preset asan
  # HDF5 asks for the lengths that a damaged file claims, and reports what it does not get.
  LSAN_OPTIONS="suppressions=$PWD/tests/leaks_of_libraries.txt" ASAN_OPTIONS=allocator_may_return_null=1 ctest --preset asan -j2 -L 'unit|mpi' || status=$?
  if command -v clang++-14 >/dev/null; then
    cmake --preset tsan
    cmake --build --preset tsan
    # libomp tells Archer what it orders; libraries that clang has not built are not looked at.
    TSAN_OPTIONS=ignore_noninstrumented_modules=1 OMP_TOOL_LIBRARIES=/usr/lib/llvm-14/lib/libarcher.so \
      build/tsan/tests/test_runtime --gtest_brief=1 || status=$?
  else
    echo "tests: no clang++-14, so that nothing ran under the thread sanitizer" >&2
  fi
fi
exit "$status"
