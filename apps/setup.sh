# Sourced by apps/demo.sh and tests/run.sh, so that both work from one package list: installs what is missing of
# apps/packages.txt and sets what Open MPI needs to run as root. Touches no package and no network when nothing is missing.
# `source apps/setup.sh tests` asks for what is marked '+' and '?' too, and goes on without the latter.

talus_install_missing() {
  local list="$1" for_tests="$2" package missing=() wished=()
  if ! command -v dpkg-query >/dev/null; then
    echo "setup: no dpkg here; this system must bring what $list names" >&2
    return 0
  fi
  for package in $(sed 's/#.*//' "$list"); do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "${package#[?+]}" 2>/dev/null)" = installed ] && continue
    case "$package" in
      \?*) [ "$for_tests" != tests ] || wished+=("${package#\?}") ;;
      +*) [ "$for_tests" != tests ] || missing+=("${package#+}") ;;
      *) missing+=("$package") ;;
    esac
  done
  [ $((${#missing[@]} + ${#wished[@]})) -gt 0 ] || return 0
  local become=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "setup: not root and no sudo; as root, run: apt-get update && apt-get install ${missing[*]} ${wished[*]}" >&2
      [ ${#missing[@]} -eq 0 ] || return 1
      echo "setup: the tests that ask ${wished[*]} are skipped" >&2
      return 0
    fi
    become=(sudo)
  fi
  local get=("${become[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Acquire::http::Timeout=30)
  echo "setup: installing ${missing[*]} ${wished[*]}"
  "${get[@]}" update
  if [ ${#missing[@]} -gt 0 ] && ! "${get[@]}" install --no-install-recommends "${missing[@]}"; then
    echo "setup: apt-get failed; Talus needs Debian 12 or newer with its main archive" >&2
    return 1
  fi
  for package in ${wished[@]+"${wished[@]}"}; do  # one by one: one that cannot be had takes no other along
    "${get[@]}" install --no-install-recommends "$package" || echo "setup: without $package the tests that ask it are skipped" >&2
  done
}

talus_install_missing "$(dirname "${BASH_SOURCE[0]}")/packages.txt" "${1:-}" || exit 1

# Containers run as root; Open MPI refuses to unless told twice.
export OMPI_ALLOW_RUN_AS_ROOT=1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
