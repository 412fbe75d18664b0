#!/bin/bash
# same_plant_test.sh BENCH SINERIG CAN_SERVO : sweeps one plant in process and over CAN and compares the
# responses; the float32 sweep twice, which must give the same numbers; then with lost replies and with late
# ones, which may change the response by no more than its interval, once the mean delay is taken out: a drive
# that says when it measured is yet to be met.
set -uo pipefail
bench=$1 sinerig=$2 servo=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rigs=$here/same_plant
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

# over_can RIG OUT [FAULT] : in a bench of its own
over_can() {
  { cat "$rigs/$1_servo.toml"; printf '[faults]\n%s\n' "${3:-}"; } >"$out/servo.toml"
  "$bench" --timeout 250 "$here/sweep_with_servo.sh" "$sinerig" "$servo" "$rigs/$1.toml" "$out/servo.toml" "$2"
  local status=$?
  [ $status -eq 0 ] || exit $status
}

"$sinerig" --log-level error run "$rigs/in_process.toml" -o "$out/in_process.sweep" >"$out/log" || { cat "$out/log"; exit 1; }
"$sinerig" --log-level error export "$out/in_process.sweep" --format csv -o "$out/in_process.csv" || exit 1
over_can can_float "$out/can_float.csv"
mv "$out/can_float.csv" "$out/first.csv"
rm "$out/can_float.csv.sweep"
over_can can_float "$out/can_float.csv"
over_can can_packed "$out/can_packed.csv"
over_can can_float "$out/lost.csv" 'lost_fraction = 0.01'
over_can can_float "$out/late.csv" 'late_max_s = 0.002'

cmp "$out/first.csv" "$out/can_float.csv" ||
  { echo "FAILED: two sweeps over CAN in virtual time gave different numbers"; exit 1; }
echo "two sweeps over CAN in virtual time gave the same numbers"
status=0
/usr/bin/python3 "$here/compare_responses.py" "$out/in_process.csv" "$out/can_float.csv" --within 1e-6 || status=1
# A Damiao drive reports its position in steps of 25 rad / 65535.
/usr/bin/python3 "$here/compare_responses.py" "$out/in_process.csv" "$out/can_packed.csv" --quantum 3.8148e-4 --rate 1000 || status=1
disturbed=$here/../modbus/compare_disturbed.py
echo "== lost"
# float32 rounds to 6e-8, 5e-7 dB of a sample; cycles repeat the rounding, the samples of one average it.
/usr/bin/python3 "$disturbed" "$out/first.csv" "$out/lost.csv" --lost 0.002 0.05 --rounding 1e-7 || status=1
echo "== late"
# Late by 0 to 2 ms, evenly, and read once a ms, the last to come: half of the replies come before the next
# read, half before the one after it, so that a quarter of the reads finds none, and what is found is
# 19/18 ms = 1.0556 ms old on average, with a scatter of 0.57 ms. That leaves 0.012 ms of the delay that fits, and
# 1.9 % of the quarter for the fewest samples, 500; 3.5 of either are allowed.
/usr/bin/python3 "$disturbed" "$out/first.csv" "$out/late.csv" --lost 0.18 0.32 --delay 0.001012 0.001099 || status=1
exit $status
