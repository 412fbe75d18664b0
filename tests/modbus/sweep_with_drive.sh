#!/bin/bash
# sweep_with_drive.sh SINERIG MODBUS_DRIVE RIG.toml DRIVE.toml OUT.csv : one sweep with the simulated drive.
# Run inside tools/virtual-bench.
set -euo pipefail
sinerig=$1 drive=$2 rig=$3 device=$4 out=$5
exec 3< <(exec "$drive" "$device")
read -r -u 3
"$sinerig" --log-level error run "$rig" --no-report -o "$out.sweep" >"$out.log" 2>&1 || { cat "$out.log"; exit 1; }
"$sinerig" --log-level error export "$out.sweep" --format csv -o "$out"
