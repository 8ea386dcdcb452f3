#!/usr/bin/env bash
# From a fresh Debian 12 to a triaxial test: installs what is missing, builds build/release/talus, runs apps/scenes/demo.toml
# into out/demo. Further arguments but --out go to `talus run`, e.g. --threads 1. Exit code: that of `talus run`, or of the step that failed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

source apps/setup.sh
cmake --preset release
cmake --build --preset release --target talus

status=0
build/release/talus run apps/scenes/demo.toml --out out/demo --force "$@" || status=$?

# 3: the run is complete, but a step missed its tolerance; there is something to look at.
if [[ " $* " != *" --dry-run "* ]] && { [ "$status" -eq 0 ] || [ "$status" -eq 3 ]; }; then
  echo
  echo "Results in $PWD/out/demo:"
  find out/demo -maxdepth 1 -type f | sort | sed 's/^/  /'
  echo "  out/demo/fields.pvd opens in ParaView. What is in each file: docs/formats.md; what it shows: docs/tutorial.md"
  echo "All of it on one page, for a browser: $PWD/out/demo/report.html"
fi
exit "$status"
