#!/bin/bash
# sweep_with_axis.sh SINERIG GPIO_AXIS RIG.toml AXIS.toml OUT : one sweep with the simulated axis on the
# lines; leaves OUT.csv, OUT.sweep. Run inside tools/virtual-bench.
set -euo pipefail
sinerig=$1 axis=$2 rig=$3 device=$4 out=$5
exec 3< <(exec "$axis" "$device")
read -r -u 3
"$sinerig" --log-level error run "$rig" --no-report -o "$out.sweep" >"$out.log" || { cat "$out.log"; exit 1; }
"$sinerig" --log-level error export "$out.sweep" --format csv -o "$out.csv"
