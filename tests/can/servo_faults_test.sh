#!/bin/bash
# servo_faults_test.sh SINERIG CAN_SERVO : what a sweep does when its drive fails. Run inside tools/virtual-bench.
set -uo pipefail
sinerig=$1 servo=$2
rigs=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/faults
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
failed=0

# sweep_with FAULT EXIT-CODE TEXT [dead] : TEXT must be in what `sinerig show` says of the run afterwards, and
# the last set-point on the bus must be neutral, unless the bus is dead.
sweep_with() {
  local fault=$1 expected=$2 text=$3
  { grep -v '^#' "$rigs/servo.toml"; echo "$fault"; } >"$out/servo.toml"
  exec 3< <(exec "$servo" "$out/servo.toml")
  local servo_pid=$!
  read -r -u 3
  candump -L vcan0,00E:7FF >"$out/commands" &
  local dump_pid=$!
  sleep 0.01
  "$sinerig" run "$rigs/rig.toml" -o "$out/run.sweep" --force >"$out/log" 2>&1
  local code=$?
  sleep 0.01
  kill -TERM "$servo_pid" "$dump_pid"
  wait "$dump_pid" 2>/dev/null
  ip link set vcan0 down && ip link set vcan0 up
  "$sinerig" show "$out/run.sweep" >"$out/shown" 2>&1
  local last
  last=$(tail -n 1 "$out/commands")
  [ "${4:-}" != dead ] || last=#0000000000000000
  if [ $code -ne "$expected" ] || ! grep -qF -- "$text" "$out/shown" || [ "${last##*#}" != 0000000000000000 ]; then
    echo "FAILED: ${fault:-no fault}: exit code $code, expected $expected and '$text'; last command $last"
    cat "$out/log" "$out/shown"
    failed=1
  else
    echo "${fault:-no fault}: exit code $code, $text"
  fi
}

sweep_with '' 0 'done'
sweep_with 'lost_fraction = 0.01' 0 'done'
sweep_with 'error_at_s = 1.0' 3 'axis_error is 64, must be = 0'
sweep_with 'power_cycle_at_s = 1.0' 3 'position'
sweep_with 'silent_at_s = 1.0' 3 'position'
sweep_with 'bus_off_at_s = 1.0' 3 'bus-off' dead
exit $failed
