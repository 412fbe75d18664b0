# shellcheck shell=bash
# Sourced by virtual-bench: the kernel, built once for a given source package and configuration.

# Prints the path of the kernel, building it first where the cache has none.
bench_kernel() {
  local config=$root/tools/virtual-bench.d/kernel.config
  local cache=${XDG_CACHE_HOME:-$HOME/.cache}/sinerig/virtual-bench
  [ "$(uname -m)" = x86_64 ] || cannot "User-Mode-Linux is built for x86_64 only; this machine is $(uname -m)"
  mkdir -p "$cache" || cannot "$cache cannot be made; set XDG_CACHE_HOME to a folder that can"

  local key kernel
  key=$({ sed 's/#.*//' "$config" | sort; declare -f adapt_source; } | sha256sum | cut -c 1-12)
  kernel=$cache/linux-$key
  if [ ! -x "$kernel" ]; then
    exec 9>"$cache/lock"
    flock 9
    [ -x "$kernel" ] || build_kernel "$config" "$cache" "$kernel"
    exec 9>&-
  fi
  echo "$kernel"
}

# In virtual time reading the clock costs time, so that a program which waits by reading it gets on:
# 256 ns, which is also the resolution. That much jitter in when commands take effect is noise in the
# 1e-6 of a response; 4 ns is not.
adapt_source() {
  sed -i 's/^#define TIMER_MULTIPLIER 256$/#define TIMER_MULTIPLIER 4/' arch/um/include/linux/time-internal.h
  grep -q '^#define TIMER_MULTIPLIER 4$' arch/um/include/linux/time-internal.h
}

build_kernel() {
  local config=$1 cache=$2 kernel=$3 archive work
  (need linux-source flex bison bc make gcc libc6-dev xz-utils) >&2 ||
    cannot "the packages that the kernel is built from and with could not be installed"
  archive=$(find /usr/src -maxdepth 1 -name 'linux-source-*.tar.xz' | sort -V | tail -n 1)
  [ -n "$archive" ] || cannot "/usr/src has no linux-source-*.tar.xz although linux-source is installed"

  work=$(mktemp -d "$cache/build.XXXXXX")
  echo "virtual-bench: building the kernel of $archive once, about 5 minutes; log in $cache/build.log" >&2
  if ! (
    tar -xf "$archive" -C "$work" --strip-components=1 &&
      cd "$work" &&
      adapt_source &&
      make ARCH=um SUBARCH=x86_64 KCONFIG_ALLCONFIG="$config" allnoconfig &&
      nice -n 10 make ARCH=um SUBARCH=x86_64 -j "$(nproc)" linux &&
      strip -o "$kernel.new" linux
  ) >"$cache/build.log" 2>&1; then
    tail -n 20 "$cache/build.log" >&2
    rm -rf "$work"
    cannot "the kernel did not build; the end of $cache/build.log is above"
  fi
  rm -rf "$work"
  mv "$kernel.new" "$kernel"
}
