#!/bin/bash
# axis_faults_test.sh BENCH SINERIG GPIO_AXIS : axis_faults.sh inside a bench.
exec "$1" --timeout 500 "$(dirname "${BASH_SOURCE[0]}")/axis_faults.sh" "$2" "$3"
