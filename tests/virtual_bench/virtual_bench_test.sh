#!/usr/bin/env bash
# virtual_bench_test.sh BENCH PERIODIC_SLEEP : what tools/virtual-bench promises.
set -uo pipefail
bench=$1 periodic_sleep=$2
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

fail() {
  echo "FAILED: $*"
  exit 1
}

"$bench" bash -c 'ip -brief link show vcan0; ls /dev/gpiochip0; echo to stderr >&2; exit 7' >"$out/1" 2>"$out/2"
status=$?
[ $status -ne 125 ] || { cat "$out/2"; exit 125; }
[ $status -eq 7 ] || fail "the exit status of the command is 7, the bench gave $status"
grep -q '^vcan0 .*UP' "$out/1" || fail "vcan0 is not up: $(cat "$out/1")"
grep -q '^/dev/gpiochip0$' "$out/1" || fail "there is no GPIO chip: $(cat "$out/1")"
[ "$(cat "$out/2")" = "to stderr" ] || fail "the error stream holds more than the command wrote: $(cat "$out/2")"

"$bench" --timeout 2 bash -c 'while :; do :; done' >"$out/1" 2>"$out/2"
[ $? -eq 124 ] || fail "a command that does not end must give 124"
grep -q 'stopped after 2 s' "$out/2" || fail "the reason for the stop is missing: $(cat "$out/2")"

SINERIG_REQUIRE_BENCH='' "$bench" --systemd --root / true 2>"$out/2"
[ $? -eq 125 ] && grep -q 'needs a --root of its own' "$out/2" || fail "systemd must not be started on this machine's root"

"$bench" "$periodic_sleep" 20000 >"$out/first" || fail "the periodic program failed"
"$bench" "$periodic_sleep" 20000 >"$out/second" || fail "the periodic program failed the second time"
cmp "$out/first" "$out/second" || fail "two virtual-time runs of one program saw different times"
latest=$(sed -n 's/^latest //p' "$out/first")
# A timer is set at least 500 ns ahead; reading the clock costs 4 ns of virtual time.
[ "$latest" -lt 1000 ] || fail "a cycle was $latest ns late in virtual time"

"$bench" --timeout 300 sleep 10000 || fail "10000 s of virtual time must fit in 300 s of real time"
echo "latest wake-up $latest ns after its deadline, the same in both runs"
