#!/bin/bash
# servo_faults_test.sh once|again SINERIG CAN_SERVO : what a sweep does when its drive or its bus fails, given up
# or armed again, and that the drive is never on with a set-point that it should not have. Run inside
# tools/virtual-bench.
set -uo pipefail
which=$1 sinerig=$2 servo=$3
rigs=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/faults
devices=$(realpath "$rigs/../../../config/devices")
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
failed=0

# The rigs: with an ODrive, given up at the first fault or armed again; with a Damiao drive.
sed "s|\.\./.*devices|$devices|" "$rigs/rig.toml" >"$out/once.toml"
{ cat "$out/once.toml"; printf '\n[retry]\nfaults = 5\nwait_s = 0.3\n'; } >"$out/again.toml"
sed 's|odrive.toml|mit-dm4310.toml|' "$out/again.toml" >"$out/packed.toml"

# switched_on LOG : prints how often the ODrive was switched on. Fails where it was switched on or off with a
# set-point that was not neutral, told one while it was off, or left on.
switched_on() {
  awk '
    function wrong(what) { print what " at " $1; failed = 1 }
    { split($3, part, "#"); data = part[2] }
    part[1] == "00E" { set_point = data; if (!on && data !~ /^0+$/) wrong("set-point " data " while it is off") }
    part[1] == "007" && data ~ /^08/ { if (set_point !~ /^0+$/) wrong("on with set-point " set_point); on = 1; ++times }
    part[1] == "007" && data ~ /^01/ { if (set_point !~ /^0+$/) wrong("off after set-point " set_point); on = 0 }
    END { if (on) { print "left on"; failed = 1 } print times + 0; exit failed }' "$1"
}

# events_of FILE KIND : how many there are
events_of() {
  /usr/bin/python3 -c 'import sqlite3, sys
print(sqlite3.connect(sys.argv[1]).execute("SELECT count(*) FROM event WHERE kind = ?", sys.argv[2:]).fetchone()[0])' "$@"
}

# sweep_with RIG FAULT EXIT-CODE TEXT ON [COMMAND] : TEXT must be in what `sinerig show` says of the run
# afterwards; ON is how often the drive must have been switched on, safely each time, or "dead" where the bus
# carries nothing at the end, or "packed" where nobody counts. COMMAND runs beside the sweep.
sweep_with() {
  local rig=$1 fault=$2 expected=$3 text=$4 on=$5 beside=${6:-true}
  { grep -v '^#' "$rigs/servo.toml"; echo "$fault"; } >"$out/servo.toml"
  [ "$rig" != packed ] || sed -i 's/odrive/mit/' "$out/servo.toml"
  exec 3< <(exec "$servo" "$out/servo.toml")
  local servo_pid=$!
  read -r -u 3
  candump -D -L vcan0,00E:7FF,007:7FF >"$out/commands" &
  local dump_pid=$!
  sleep 0.01
  bash -c "$beside" &
  local beside_pid=$!
  "$sinerig" run "$out/$rig.toml" --no-report -o "$out/run.sweep" --force >"$out/log" 2>&1
  local code=$?
  wait "$beside_pid"
  sleep 1  # what is in a full queue goes out late
  tc qdisc del dev vcan0 root 2>/dev/null
  sleep 0.01
  kill -TERM "$servo_pid" "$dump_pid"
  wait "$dump_pid" 2>/dev/null
  ip link set vcan0 down && ip link set vcan0 up
  "$sinerig" show "$out/run.sweep" >"$out/shown" 2>&1
  local safe=$on rearmed=$((code != 0 || $(events_of "$out/run.sweep" rearmed) > 0))
  case $on in
    dead | packed) ;;
    *) safe=$(switched_on "$out/commands") ;;
  esac
  [ "$rig" != once ] || rearmed=1
  if [ $code -ne "$expected" ] || ! grep -qF -- "$text" "$out/shown" || [ "$safe" != "$on" ] || [ $rearmed -eq 0 ]; then
    echo "FAILED: $rig, ${fault:-no fault}, $beside: exit code $code, expected $expected and '$text'; switched on: $safe, expected $on"
    cat "$out/log" "$out/shown" "$out/commands"
    failed=1
  else
    echo "$rig, ${fault:-no fault}, $beside: exit code $code, $text; switched on: $on"
  fi
}

# Half as much again as the bus carries; alone, the drive's own frames, which take the same way here, leave room.
full='sleep 1; tc qdisc replace dev vcan0 root tbf rate 80kbit burst 64 limit 160'
down='sleep 1; ip link set vcan0 down'

case $which in
  once)
    sweep_with once '' 0 'done' 1
    sweep_with once 'lost_fraction = 0.01' 0 'done' 1
    sweep_with once 'error_at_s = 1.0' 3 'axis_error is 64, must be = 0' 1
    sweep_with once 'power_cycle_at_s = 1.0' 3 'position' 1
    sweep_with once 'silent_at_s = 1.0' 3 'position' 1
    sweep_with once 'bus_off_at_s = 1.0' 3 'bus-off' dead
    sweep_with once '' 3 'vcan0: the transmit queue is full' 1 "$full"
    sweep_with once '' 3 'vcan0: link down' dead "$down"
    ;;
  again)  # each of them costs a repeated point, or what cannot be mended five tries
    sweep_with again 'error_at_s = 1.0' 0 'device_fault: axis_error is 64, must be = 0' 2
    sweep_with again 'power_cycle_at_s = 1.0' 0 "rearm_failed: vcan0: arm step 'closed-loop control' was not answered" 3
    sweep_with again $'bus_off_at_s = 1.0\nbus_off_for_s = 0.2' 0 'device_fault: vcan0: bus-off' 2
    sweep_with again '' 0 'vcan0: the transmit queue is full' 2 "$full; sleep 0.1; tc qdisc del dev vcan0 root"
    sweep_with again '' 0 'device_fault: vcan0: link down' 2 "$down; sleep 0.2; ip link set vcan0 up"
    sweep_with again 'silent_at_s = 1.0' 3 '(5 tries to arm again are spent, [retry])' 6
    sweep_with packed 'error_at_s = 1.0' 0 'device_fault: drive_state is 11, must be = 1' packed
    sweep_with packed 'power_cycle_at_s = 1.0' 0 'tripped: position has had no good sample' packed
    ;;
esac
exit $failed
