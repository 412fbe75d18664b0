#!/bin/bash
# axis_faults.sh SINERIG GPIO_AXIS : what a sweep does when its axis, its lines or its rig file are wrong.
# Run inside tools/virtual-bench.
set -uo pipefail
sinerig=$1 axis=$2
rigs=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/faults
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
failed=0

# start_axis FAULT : the axis with this key of [faults], on file descriptor 3
start_axis() {
  { cat "$rigs/axis.toml"; echo "$1"; } >"$out/axis.toml"
  exec 3< <(exec "$axis" "$out/axis.toml")
  axis_pid=$!
  read -r -u 3
}

# end_axis : leaves what it had to say in $said
end_axis() {
  kill -TERM "$axis_pid"
  said=$(cat <&3)
  exec 3<&-
}

# expect CASE WANTED-CODE CODE TEXT FILE
expect() {
  if [ "$2" -eq "$3" ] && grep -qF -- "$4" "$5"; then
    echo "$1: exit code $3, $4"
  else
    echo "FAILED: $1: exit code $3, expected $2 and '$4' in"
    cat "$5"
    failed=1
  fi
}

# sweep_with FAULT EXIT-CODE TEXT [EDIT] : TEXT must be in what `sinerig show` says of the run afterwards; EDIT
# is a sed expression for the rig file
sweep_with() {
  start_axis "$1"
  sed "${4:-}" "$rigs/rig.toml" >"$out/rig.toml"
  "$sinerig" run "$out/rig.toml" --no-report -o "$out/run.sweep" --force >"$out/log" 2>&1
  local code=$?
  end_axis
  "$sinerig" show "$out/run.sweep" >"$out/shown" 2>&1
  expect "${1:-no fault}${4:+ with $4}" "$2" $code "$3" "$out/shown"
}

sweep_with '' 0 'done'
sweep_with 'pulse_at_s = 1.0' 0 'done'
sweep_with 'pulse_at_s = 1.0' 3 '1 lost edges (errors_max = 0)' '/^scale/a errors_max = 0'
sweep_with 'burst_at_s = 1.0' 3 'lost edges (errors_max = 10)'
sweep_with 'stuck_at_s = 0.3' 0 'low_signal'
sweep_with 'interlock_at_s = 1.0' 3 'stop: the interlock is open'
# Seen at the next tick, neutral and disabled at the one after.
late=$(echo "$said" | awk '/^off/ { print ($2 > 0 && $2 <= 0.0021) ? "in time" : "too late" }')
[ "$late" = "in time" ] || { echo "FAILED: the drive must be off within 2 ticks of an open interlock: $said"; failed=1; }
echo "the drive was $said"

start_axis 'interlock_at_s = 0.1'
sleep 0.2
"$sinerig" run "$rigs/rig.toml" --no-report -o "$out/open.sweep" >"$out/log" 2>&1
expect 'interlock open from the start' 1 $? 'stop: the interlock is open (chip gpiochip0, line 6 is not active)' "$out/log"
[ ! -e "$out/open.sweep" ] || { echo "FAILED: a sweep that never began left a file"; failed=1; }
end_axis

start_axis ''
"$sinerig" run "$rigs/rig.toml" --no-report -o "$out/first.sweep" >"$out/first" 2>&1 &
first=$!
sleep 1
"$sinerig" run "$rigs/rig.toml" --no-report -o "$out/second.sweep" >"$out/log" 2>&1
expect 'line in use' 1 $? 'is used by "sinerig"' "$out/log"
kill -TERM $first
wait $first
code=$?
"$sinerig" show "$out/first.sweep" >"$out/shown" 2>&1
expect "SIGTERM" 4 $code 'interrupted' "$out/shown"
end_axis

sed 's/gpiochip0/gpiochip9/' "$rigs/rig.toml" >"$out/rig.toml"
"$sinerig" run "$out/rig.toml" --no-report -o "$out/none.sweep" >"$out/log" 2>&1
expect 'no such chip' 1 $? 'gpiochip9: there is no such GPIO chip; this machine has gpiochip0 "gpio-sim.0-node0"' "$out/log"
exit $failed
