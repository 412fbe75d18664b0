#!/usr/bin/env bash
# shipped_pairs_test.sh ROOT : on the virtual bench; each rig file of config/ that is for a bus, with the simulated
# device that is shipped for it, by the command that the documentation gives, at three of its frequencies.
set -euo pipefail
root=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp -r "$root/config/." "$folder"
cd "$folder"
export SINERIG_ON_BENCH=1

pair() { # DEVICE RIG
  sed -i -E 's/^points = [0-9]+/points = 3/; s/^start_hz = [0-9.]+/start_hz = 5/' "$2.toml"
  if ! "$root/sim/$1/sweep" "$2.toml" -o "$2.sweep" --quiet --no-report; then
    echo "$2: its sweep failed"
    return 1
  fi
  local good
  good=$("$root/build/release/sinerig" show "$2.sweep" | grep -c ' good$') || true
  echo "$2: $good good points"
  [ "$good" -ge 3 ] && [ $((good % 3)) -eq 0 ] || { "$root/build/release/sinerig" show "$2.sweep"; return 1; }
}

pair can_servo can-gimbal
pair modbus_drive modbus-gimbal
pair modbus_drive modbus-rtu-gimbal
pair gpio_axis gpio-gimbal
