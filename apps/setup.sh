# Sourced by apps/demo.sh and tests/run.sh, so that both work from one package list: installs what is missing of
# apps/packages.txt and sets what Open MPI needs to run as root. Touches no package and no network when nothing is missing.

talus_install_missing() {
  local list="$1" package missing=()
  if ! command -v dpkg-query >/dev/null; then
    echo "setup: no dpkg here; this system must bring what $list names" >&2
    return 0
  fi
  for package in $(sed 's/#.*//' "$list"); do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0

  local become=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "setup: not root and no sudo; as root, run: apt-get update && apt-get install ${missing[*]}" >&2
      return 1
    fi
    become=(sudo)
  fi
  echo "setup: installing ${missing[*]}"
  "${become[@]}" apt-get update -q &&
    "${become[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}" || {
    echo "setup: apt-get failed; Talus needs Debian 12 or newer with its main archive" >&2
    return 1
  }
}

talus_install_missing "$(dirname "${BASH_SOURCE[0]}")/packages.txt" || exit 1

# Containers run as root; Open MPI refuses to unless told twice.
export OMPI_ALLOW_RUN_AS_ROOT=1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
