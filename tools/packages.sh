# shellcheck shell=bash
# Sourced by the tools beside it: the Debian packages the project needs, installed when missing, and
# the steps the tools share.

build_packages=(
  cmake ninja-build g++ pkg-config
  libeigen3-dev libspdlog-dev libgtest-dev libgmock-dev libbenchmark-dev
  libtomlplusplus-dev libcli11-dev libsqlite3-dev nlohmann-json3-dev
  libmatio-dev librsvg2-dev libmodbus-dev libgpiod-dev
)

# What only tests need; without them the tests concerned are skipped and say so.
test_packages=(
  fonts-dejavu-core python3-scipy python3-jsonschema python3-pymodbus python3-serial-asyncio
)

# What `tools/bench realtime` measures beside and under.
bench_packages=(
  rt-tests stress-ng
)

# Heavy ones, for the same: the pages in a browser, the exports in Octave, completion in other shells.
# CI installs them; `tools/test --full` does here.
optional_test_packages=(
  chromium octave zsh fish groff
)

# usage TOOL : the comment at its head.
usage() { sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$1"; }

# misuse TOOL MESSAGE : what was wrong, how to call it instead, exit code 2.
misuse() {
  echo "${1##*/}: $2" >&2
  usage "$1" >&2
  exit 2
}

newly_installed=

# need PACKAGE… : installs what is missing, as root or through sudo; otherwise prints the line to run and stops.
need() {
  if ! command -v dpkg-query >/dev/null; then
    echo "No Debian here: taking it that what these packages hold is installed: $*" >&2
    return 0
  fi
  local installed missing=() package
  installed=" $(dpkg-query -W -f '${Package}:${db:Status-Status} ' "$@" 2>/dev/null || true)"
  for package in "$@"; do
    [[ $installed == *" $package:installed "* ]] || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0

  local as=()
  if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [ -t 0 ]; }; then
      as=(sudo)
    else
      echo "These Debian packages are missing; run this line as root, then call again:" >&2
      echo "  apt-get update && apt-get install --yes --no-install-recommends ${missing[*]}" >&2
      exit 1
    fi
  fi
  echo "Installing (some minutes on a fresh machine): ${missing[*]}" >&2
  # A fresh machine is often still busy with its own upgrades: wait for the lock. Of apt's chatter only
  # what went wrong is worth reading.
  local log
  log=$(mktemp)
  if ! {
    "${as[@]}" apt-get -o DPkg::Lock::Timeout=300 update -q &&
      "${as[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=300 install \
        --yes -q --no-install-recommends "${missing[@]}"
  } </dev/null >"$log" 2>&1; then
    { grep -E '^[EW]:' "$log" || cat "$log"; } | tail -n 5 >&2
    rm -f "$log"
    echo "apt could not install the packages (above: the end of what it said). Is there a network, and" >&2
    echo "is this Debian 12 or later? Once that is mended, call again." >&2
    exit 1
  fi
  rm -f "$log"
  newly_installed=yes
}

# configure PRESET : once, again when the presets have changed or need() has installed something, which may be
# what was not found then, and from the beginning in a tree that was copied or moved, which builds the other.
configure() {
  local tree="$root/build/$1" fresh=()
  if [ -f "$tree/CMakeCache.txt" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$tree/CMakeCache.txt"; then
    fresh=(--fresh)
  elif [ -f "$tree/build.ninja" ] && [ -z "$newly_installed" ] &&
    [ ! "$root/CMakePresets.json" -nt "$tree/CMakeCache.txt" ]; then
    return
  fi
  (cd "$root" && cmake --preset "$1" "${fresh[@]}" >&2)
}

# build PRESET [TARGET] : builds what changed.
build() {
  configure "$1"
  cmake --build "$root/build/$1" --target "${2:-all}" >&2
}
