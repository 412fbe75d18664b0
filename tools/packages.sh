# shellcheck shell=bash
# Sourced by run, test and bench: the Debian packages the project needs, installed when missing.

build_packages=(
  cmake ninja-build g++ pkg-config
  libeigen3-dev libspdlog-dev libgtest-dev libgmock-dev libbenchmark-dev
  libtomlplusplus-dev libcli11-dev libsqlite3-dev nlohmann-json3-dev
  librsvg2-dev
)

# What only tests need; without them the tests concerned are skipped and say so.
test_packages=(
  chromium fonts-dejavu-core
)

# need PACKAGE… : installs what is missing, as root or through sudo; otherwise prints the line to run and stops.
need() {
  local missing=() package
  for package in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0

  local as=()
  if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo >/dev/null && sudo -n true 2>/dev/null || { [ -t 0 ] && command -v sudo >/dev/null; }; then
      as=(sudo)
    else
      echo "These Debian packages are missing; run this line as root, then call again:" >&2
      echo "  apt-get update && apt-get install --yes --no-install-recommends ${missing[*]}" >&2
      exit 1
    fi
  fi
  echo "Installing: ${missing[*]}" >&2
  "${as[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq >&2
  "${as[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes -qq --no-install-recommends "${missing[@]}" >&2
}

# build PRESET [TARGET] : configures once, then builds what changed.
build() {
  local preset=$1 target=${2:-all}
  [ -f "$root/build/$preset/build.ninja" ] || cmake -S "$root" --preset "$preset" >&2
  cmake --build "$root/build/$preset" --target "$target" >&2
}
