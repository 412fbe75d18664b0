#!/bin/bash
# same_plant_test.sh BENCH SINERIG MODBUS_DRIVE : sweeps one plant in process, over Modbus TCP and RTU, and
# compares the responses; one of them twice, which must give the same numbers; then with lost replies and
# with late ones, which may change the response by no more than its interval.
set -uo pipefail
bench=$1 sinerig=$2 drive=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
rigs=$here/same_plant
compare=$here/../can/compare_responses.py
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

# over_modbus RIG NAME [FAULT…] : in a bench of its own; leaves NAME.csv
over_modbus() {
  local rig=$1 name=$2
  shift 2
  { cat "$rigs/${rig}_drive.toml"; printf '%s\n' "$@"; } >"$out/$name-drive.toml"
  "$bench" --timeout 250 "$here/sweep_with_drive.sh" "$sinerig" "$drive" "$rigs/$rig.toml" \
    "$out/$name-drive.toml" "$out/$name.csv"
  local status=$?
  [ $status -eq 0 ] || exit $status
}

"$sinerig" --log-level error run "$rigs/in_process.toml" --no-report -o "$out/in_process.sweep" >"$out/log" ||
  { cat "$out/log"; exit 1; }
"$sinerig" --log-level error export "$out/in_process.sweep" --format csv -o "$out/in_process.csv" || exit 1
over_modbus tcp_float tcp
over_modbus tcp_float tcp_again
over_modbus rtu_float64 rtu
over_modbus rtu_int16 rtu_int16
# Without the rounding of float32, which is no part of an interval.
sed 's/float32/float64/' "$rigs/tcp_float.toml" >"$out/tcp_double.toml"
sed 's/float32/float64/' "$rigs/tcp_float_drive.toml" >"$out/tcp_double_drive.toml"
rigs=$out
over_modbus tcp_double lost 'lost_fraction = 0.01'
over_modbus tcp_double late 'late_max_s = 0.002'
rigs=$here/same_plant
over_modbus rtu_float64 rtu_lost 'lost_fraction = 0.01'

cmp "$out/tcp.csv" "$out/tcp_again.csv" ||
  { echo "FAILED: two sweeps over Modbus in virtual time gave different numbers"; exit 1; }
echo "two sweeps over Modbus in virtual time gave the same numbers"
status=0
for case in 'tcp --within 1e-6' 'rtu --within 1e-6' 'rtu_int16 --quantum 1e-5 --rate 100'; do
  set -- $case
  echo "== $1"
  /usr/bin/python3 "$compare" "$out/in_process.csv" "$out/$1.csv" "${@:2}" || status=1
done
for case in 'lost 0.002 0.05' 'late 0 0' 'rtu_lost 0.002 0.12'; do
  set -- $case
  echo "== $1"
  /usr/bin/python3 "$here/compare_disturbed.py" "$out/in_process.csv" "$out/$1.csv" --lost "$2" "$3" || status=1
done
exit $status
