#!/usr/bin/env bash
# run.sh TALUS [pytest options]: tests apps/python with the program TALUS, by the first Python that has what they need.
# Exit code 77, which ctest counts as skipped, where none has.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

TALUS="$(realpath "$1")"; export TALUS
shift
for python in /usr/bin/python3 python3; do
  if "$python" -c 'import h5py, matplotlib, numpy, pytest, tomli_w, tomllib' 2>/dev/null; then
    # Ranks of tests run beside others; files of the interpreter stay out of the tree.
    OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 MPLBACKEND=Agg PYTHONDONTWRITEBYTECODE=1 \
      PYTHONPATH="$PWD/apps/python" exec "$python" -m pytest -q -p no:cacheprovider tests/python "$@"
  fi
done
echo "skipped: no Python >= 3.11 here has h5py, matplotlib, numpy, pytest and tomli_w (Debian: python3-h5py python3-matplotlib" \
  "python3-numpy python3-pytest python3-tomli-w)"
exit 77
