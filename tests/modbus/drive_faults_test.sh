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

# sweep_with TRANSPORT FAULT EXIT-CODE TEXT [dead] : TEXT must be in what `sinerig show` says of the run
# afterwards, and the drive must be off, its set-point and its torque 0, unless it no longer answers.
sweep_with() {
  local transport=$1 fault=$2 expected=$3 text=$4
  { cat "$out/$transport-drive.toml"; echo "$fault"; } >"$out/drive.toml"
  exec 3< <(exec "$drive" "$out/drive.toml")
  local drive_pid=$!
  read -r -u 3
  "$sinerig" run "$out/$transport.toml" --no-report -o "$out/run.sweep" --force >"$out/log" 2>&1
  local code=$?
  sleep 1   # a drive that has lost its power boots
  "$sinerig" check "$out/$transport.toml" --seconds 2 >"$out/check" 2>&1
  kill -TERM "$drive_pid"
  wait "$drive_pid"
  "$sinerig" show "$out/run.sweep" >"$out/shown" 2>&1
  local neutral
  neutral=$(grep -cE '^(set_point|torque) .* 0 1$' "$out/check")
  [ "${5:-}" != dead ] || neutral=2
  if [ $code -ne "$expected" ] || ! grep -qF -- "$text" "$out/shown" || [ "$neutral" -ne 2 ]; then
    echo "FAILED: $transport, ${fault:-no fault}: exit code $code, expected $expected and '$text'"
    cat "$out/log" "$out/shown" "$out/check"
    failed=1
  else
    echo "$transport, ${fault:-no fault}: exit code $code, $(grep '^outcome' "$out/shown" | tr -s ' ')"
  fi
}

for transport in tcp rtu; do
  sweep_with $transport '' 0 'done'
  sweep_with $transport 'lost_fraction = 0.01' 0 'done'
  sweep_with $transport 'spoiled_fraction = 0.01' 0 'done'
  sweep_with $transport $'late_fraction = 0.01\nlate_s = 0.025' 0 'done'
  sweep_with $transport 'exception_fraction = 0.001' 0 'done'
  sweep_with $transport 'exception_at_s = 2.0' 3 'exception 4, device failure' dead
  sweep_with $transport 'silent_at_s = 2.0' 3 'no answer in time' dead
  sweep_with $transport 'error_at_s = 2.0' 3 'drive state is 2, must be = 1'
  sweep_with $transport 'drop_at_s = 2.0' 0 'done'
done
sweep_with tcp 'power_cycle_at_s = 2.0' 3 'connection lost'
# Whether the line is gone first or an answer is missed is a matter of microseconds.
sweep_with rtu 'power_cycle_at_s = 2.0' 3 '/line: '
# Armed again, the same power cut costs a repeated point; an error that stays, five tries.
printf '\n[retry]\nfaults = 5\nwait_s = 1\n' >>"$out/tcp.toml"
sweep_with tcp 'power_cycle_at_s = 2.0' 0 'device_fault: 127.0.0.1:5020: connection lost'
sweep_with tcp 'error_at_s = 2.0' 3 '(5 tries to arm again are spent, [retry])'
exit $failed
