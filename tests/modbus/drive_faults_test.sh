#!/bin/bash
# drive_faults_test.sh SINERIG MODBUS_DRIVE : what a sweep does when its drive fails, over TCP and over a
# serial line. Run inside tools/virtual-bench.
set -uo pipefail
sinerig=$1 drive=$2
rigs=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/faults
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
failed=0
cp "$rigs/tcp.toml" "$out/tcp.toml"
sed -e 's/^transport = "tcp"/transport = "rtu"/' -e '/^host = /d' -e '/^rate_hz/s/100/50/' \
  -e "s|^port = .*|device = \"$out/line\"|" "$rigs/tcp.toml" >"$out/rtu.toml"
cp "$rigs/drive.toml" "$out/tcp-drive.toml"
sed -e 's/^transport = "tcp"/transport = "rtu"/' -e "s|^port = .*|link = \"$out/line\"|" "$rigs/drive.toml" \
  >"$out/rtu-drive.toml"

# The drive forgets its fault where it is told to before it is armed; and the sweep tries again.
{ cat "$out/tcp.toml"; printf '\n[retry]\nfaults = 5\nwait_s = 0.3\n'; } >"$out/tcp-again.toml"
{ cat "$out/rtu.toml"; printf '\n[retry]\nfaults = 5\nwait_s = 0.3\n'; } >"$out/rtu-again.toml"
clear='[[actuator.startup]]\nname = "clear faults"\nregister = 0\nvalue = 2'
for transport in tcp rtu; do
  sed "0,/^\[\[actuator.arm/s//$clear\n&/" "$out/$transport-again.toml" >"$out/$transport-clear.toml"
done

# safely_on ACCOUNT : prints how often the drive was switched on. Fails where it was switched on or off with a
# set-point that was not neutral, or left on.
safely_on() {
  awk '
    /^(on|off) / && $NF != 0 { print "wrong: " $0; failed = 1 }
    /^(on|off|tripped) / { state = $1; if (state == "on") ++times }
    END { if (state == "on") { print "left on"; failed = 1 } print times + 0; exit failed }' "$1"
}

# sweep_with TRANSPORT RIG FAULT EXIT-CODE TEXT ON : TEXT must be in what `sinerig show` says of the run
# afterwards; ON is how often the drive must have been switched on, safely each time; or "dead" where it no
# longer hears, or "cut" where its power was cut while it was on.
sweep_with() {
  local transport=$1 rig=$2 fault=$3 expected=$4 text=$5 on=$6
  { cat "$out/$transport-drive.toml"; echo "$fault"; } >"$out/drive.toml"
  exec 3< <(exec "$drive" "$out/drive.toml")
  local drive_pid=$!
  read -r -u 3
  "$sinerig" run "$out/$rig.toml" --no-report -o "$out/run.sweep" --force >"$out/log" 2>&1
  local code=$?
  sleep 1   # a drive that has lost its power boots
  "$sinerig" check "$out/$transport.toml" --seconds 2 >"$out/check" 2>&1
  kill -TERM "$drive_pid"
  cat <&3 >"$out/account"
  exec 3<&-
  "$sinerig" show "$out/run.sweep" >"$out/shown" 2>&1
  local neutral safe
  neutral=$(grep -cE '^(set_point|torque) .* 0 1$' "$out/check")
  # A power cut is no choice of the set-point.
  [ "${on#cut }" = "$on" ] || sed -i '/^off at 2\.0/s/-point .*/-point 0/' "$out/account"
  safe=$(safely_on "$out/account")
  [ "$on" != dead ] || { neutral=2; safe=$on; }
  if [ $code -ne "$expected" ] || ! grep -qF -- "$text" "$out/shown" || [ "$neutral" -ne 2 ] || [ "$safe" != "${on#cut }" ]; then
    echo "FAILED: $rig, ${fault:-no fault}: exit code $code, expected $expected and '$text'; switched on: $safe, expected $on"
    cat "$out/log" "$out/shown" "$out/check" "$out/account"
    failed=1
  else
    echo "$rig, ${fault:-no fault}: exit code $code, $(grep '^outcome' "$out/shown" | tr -s ' '); switched on: $on"
  fi
}

for transport in tcp rtu; do
  sweep_with $transport $transport '' 0 'done' 1
  sweep_with $transport $transport 'lost_fraction = 0.01' 0 'done' 1
  sweep_with $transport $transport 'spoiled_fraction = 0.01' 0 'done' 1
  sweep_with $transport $transport $'late_fraction = 0.01\nlate_s = 0.025' 0 'done' 1
  sweep_with $transport $transport 'exception_fraction = 0.001' 0 'done' 1
  sweep_with $transport $transport 'exception_at_s = 2.0' 3 'exception 4, device failure' dead
  sweep_with $transport $transport 'silent_at_s = 2.0' 3 'no answer in time' dead
  sweep_with $transport $transport 'error_at_s = 2.0' 3 'drive state is 2, must be = 1' 1
  sweep_with $transport $transport 'drop_at_s = 2.0' 0 'done' 1
done
sweep_with tcp tcp 'power_cycle_at_s = 2.0' 3 'connection lost' 'cut 1'
# Whether the line is gone first or an answer is missed is a matter of microseconds.
sweep_with rtu rtu 'power_cycle_at_s = 2.0' 3 '/line: ' 'cut 1'
# Armed again, a power cut or a trip costs a repeated point; an error that stays, five tries.
sweep_with tcp tcp-again 'power_cycle_at_s = 2.0' 0 'device_fault: 127.0.0.1:5020: connection lost' 'cut 2'
sweep_with rtu rtu-again 'power_cycle_at_s = 2.0' 0 'device_fault: ' 'cut 2'
sweep_with tcp tcp-clear 'error_at_s = 2.0' 0 'device_fault: drive state is 2, must be = 1' 2
sweep_with rtu rtu-clear 'error_at_s = 2.0' 0 'device_fault: drive state is 2, must be = 1' 2
sweep_with tcp tcp-again 'error_at_s = 2.0' 3 '(5 tries to arm again are spent, [retry])' 1
exit $failed
