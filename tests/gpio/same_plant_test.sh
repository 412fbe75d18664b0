#!/bin/bash
# same_plant_test.sh BENCH SINERIG GPIO_AXIS : same_plant.sh inside a bench; then one sweep in each of two
# fresh benches, which must give the same numbers.
set -uo pipefail
bench=$1 sinerig=$2 axis=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rigs=$here/same_plant
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

"$bench" --timeout 500 "$here/same_plant.sh" "$sinerig" "$axis" || exit
for run in first second; do
  "$bench" --timeout 250 "$here/sweep_with_axis.sh" "$sinerig" "$axis" \
    "$rigs/sign_magnitude.toml" "$rigs/sign_magnitude_axis.toml" "$out/$run" || exit
done
cmp "$out/first.csv" "$out/second.csv" ||
  { echo "FAILED: two sweeps over GPIO in virtual time gave different numbers"; exit 1; }
echo "two sweeps over GPIO in virtual time gave the same numbers"
