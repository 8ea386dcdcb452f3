#!/usr/bin/env bash
# Every test: installs what is missing, checks the format of the sources, builds preset `ci` (warnings are errors), runs ctest.
# Further arguments go to ctest, e.g. -L unit. With TALUS_SANITIZERS=1 the tests of units and of several ranks run again
# under the address and undefined-behaviour sanitizers; with TALUS_SMPI=1 the command is built for simulated ranks as well (some
# minutes), and its tests are not skipped. Exit code 0 only if all of it passed.
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

if [ "${TALUS_SMPI:-0}" = 1 ]; then
  cmake --preset smpi
  cmake --build --preset smpi
fi
cmake --preset ci
cmake --build --preset ci
ctest --preset ci -j2 "$@" || status=$?

if [ "${TALUS_SANITIZERS:-0}" = 1 ]; then
  cmake --preset asan
  cmake --build --preset asan
  ctest --preset asan -j2 -L 'unit|mpi' || status=$?
fi
exit "$status"
