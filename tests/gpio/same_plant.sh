#!/bin/bash
# same_plant.sh SINERIG GPIO_AXIS : sweeps one plant in process and over GPIO lines, driven in each of the
# three ways, and compares the responses; one sweep twice, which must give the same numbers. Run inside
# tools/virtual-bench.
set -uo pipefail
sinerig=$1 axis=$2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rigs=$here/same_plant
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

# sweep RIG OUT
sweep() {
  "$sinerig" --log-level error run "$rigs/$1.toml" --no-report -o "$out/$2.sweep" >"$out/log" &&
    "$sinerig" --log-level error export "$out/$2.sweep" --format csv -o "$out/$2.csv" ||
    { cat "$out/log"; exit 1; }
}

# over_gpio RIG OUT
over_gpio() {
  exec 3< <(exec "$axis" "$rigs/$1_axis.toml")
  local axis_pid=$!
  read -r -u 3
  sweep "$1" "$2"
  kill -TERM $axis_pid
  exec 3<&-
}

sweep in_process in_process
status=0
for output in density sign_magnitude step; do
  over_gpio $output $output
  echo "$output:"
  # A count is 4e-4 rad.
  /usr/bin/python3 "$here/../can/compare_responses.py" "$out/in_process.csv" "$out/$output.csv" --quantum 4e-4 --rate 1000 || status=1
done
exit $status
