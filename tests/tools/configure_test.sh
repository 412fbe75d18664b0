#!/usr/bin/env bash
# configure_test.sh TOOLS : when the tools configure a build tree again, with a cmake that notes how it is called.
set -uo pipefail
tools=$1
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
root="$out/here"
mkdir -p "$out/bin" "$root/build/release"
cat >"$out/bin/cmake" <<END
#!/usr/bin/env bash
echo "\$*" >>"$out/calls"
touch "$root/build/release/build.ninja"
echo "CMAKE_HOME_DIRECTORY:INTERNAL=$root" >"$root/build/release/CMakeCache.txt"
END
chmod +x "$out/bin/cmake"
PATH="$out/bin:$PATH"
touch "$root/CMakePresets.json"
. "$tools/packages.sh"

# expect CALLS WHY : what configure() called since the last time.
expect() {
  : >"$out/calls"
  configure release
  [ "$(cat "$out/calls")" = "$1" ] || { echo "FAILED: $2: called '$(cat "$out/calls")', expected '$1'"; exit 1; }
}

expect "--preset release" "nothing is there yet"
expect "" "nothing has changed"
touch -d '1 minute' "$root/CMakePresets.json"
expect "--preset release" "the presets have changed"
touch -d '1 minute ago' "$root/CMakePresets.json"
newly_installed=yes
expect "--preset release" "a package was installed, which may not have been found before"
newly_installed=
echo "CMAKE_HOME_DIRECTORY:INTERNAL=$out/elsewhere" >"$root/build/release/CMakeCache.txt"
expect "--preset release --fresh" "the tree was copied from elsewhere"
expect "" "that is mended"
