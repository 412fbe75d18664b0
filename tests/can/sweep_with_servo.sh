#!/bin/bash
# sweep_with_servo.sh SINERIG CAN_SERVO RIG.toml SERVO.toml OUT.csv : one sweep with the simulated drive on
# the bus. Run inside tools/virtual-bench, whose one CPU they share: a drive has its own, so that the simulated
# one goes before the loop and answers at once.
set -euo pipefail
sinerig=$1 servo=$2 rig=$3 device=$4 out=$5
exec 3< <(exec chrt --fifo 90 "$servo" "$device")
read -r -u 3
"$sinerig" --log-level error run "$rig" -o "$out.sweep" >"$out.log" || { cat "$out.log"; exit 1; }
"$sinerig" --log-level error export "$out.sweep" --format csv -o "$out"
