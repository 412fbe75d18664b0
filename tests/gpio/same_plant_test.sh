#!/bin/bash
# same_plant_test.sh BENCH SINERIG GPIO_AXIS : sweeps one plant in process and over GPIO lines, driven in
# each of the three ways, and compares the responses; one sweep twice, which must give the same numbers.
# BENCH_ROOT names the Debian that the bench runs in, with everything else below it.
set -uo pipefail
bench=$1 sinerig=$2 axis=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rigs=$here/same_plant
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

# over_gpio RIG OUT : in a bench of its own
over_gpio() {
  "$bench" --timeout 250 "$here/sweep_with_axis.sh" "$sinerig" "$axis" "$rigs/$1.toml" "$rigs/$1_axis.toml" "$2"
  local status=$?
  [ $status -eq 0 ] || exit $status
}

"$sinerig" --log-level error run "$rigs/in_process.toml" -o "$out/in_process.sweep" >"$out/log" || { cat "$out/log"; exit 1; }
"$sinerig" --log-level error export "$out/in_process.sweep" --format csv -o "$out/in_process.csv" || exit 1
status=0
for output in density sign_magnitude step; do
  over_gpio $output "$out/$output"
  echo "$output:"
  # A count is 4e-4 rad.
  /usr/bin/python3 "$here/../can/compare_responses.py" "$out/in_process.csv" "$out/$output.csv" --quantum 4e-4 --rate 1000 || status=1
done
over_gpio sign_magnitude "$out/again"
cmp "$out/sign_magnitude.csv" "$out/again.csv" ||
  { echo "FAILED: two sweeps over GPIO in virtual time gave different numbers"; exit 1; }
echo "two sweeps over GPIO in virtual time gave the same numbers"
exit $status
