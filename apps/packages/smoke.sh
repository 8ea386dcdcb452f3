#!/usr/bin/env bash
# Does an installed Talus work? Runs the demo for 20 steps, its page, two ranks if there is an mpirun, and the
# Python package if it is there. Says "smoke: passed" at the end.
#
#     smoke.sh [SCENES]      folder of the scenes [../share/talus/scenes beside the program in PATH]
set -euo pipefail
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
program=$(command -v talus)
scenes=${1:-$(dirname "$(dirname "$(readlink -f "$program")")")/share/talus/scenes}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

talus --version
talus run "$scenes/demo.toml" --out one --steps 20 --quiet
talus report one -o page.html
grep -q "20 steps" page.html
digest() { sed -n 's/.*"digest": "\([0-9a-f]*\)".*/\1/p' "$1/run.json"; }
if command -v mpirun >/dev/null; then
  talus run "$scenes/demo.toml" --out cut --steps 20 --quiet --set decomposition.subdomains=4
  mpirun --oversubscribe -n 2 talus run "$scenes/demo.toml" --out two --steps 20 --quiet --threads 1 --set decomposition.subdomains=4
  [ -n "$(digest cut)" ] && [ "$(digest cut)" = "$(digest two)" ]
  echo "smoke: one rank and two end in the same bits"
fi
if command -v python3 >/dev/null && python3 -c "import talus" 2>/dev/null; then
  python3 -c "
import talus
run = talus.open('one')
assert len(run.steps['step']) == 20
print('smoke: Python reads', len(run.frame(-1).radii), 'grains')"
fi
echo "smoke: passed"
