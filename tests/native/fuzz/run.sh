#!/usr/bin/env bash
# run.sh SECONDS JOBS [TARGET...]: each target for so long, so many at a time, from the seeds of the tests and from inputs
# that earlier runs kept in build/fuzz/corpus. Prints a line for each. Inputs that break a target stay in build/fuzz.
set -euo pipefail
cd "$(dirname "$0")/../../../build/fuzz"
export PROGRAM=$PWD/tests/native/fuzz/fuzz_targets SECONDS_OF_EACH=$1
jobs=$2
shift 2
MAQ_FUZZ_SEEDS=$PWD/seeds "$PROGRAM"
[ $# -gt 0 ] || set -- $(ls seeds)

fuzz_one() {
    mkdir -p "corpus/$1"
    status=0
    MAQ_FUZZ_TARGET=$1 "$PROGRAM" "corpus/$1" "seeds/$1" -max_total_time="$SECONDS_OF_EACH" -timeout=20 -rss_limit_mb=3000 \
        -malloc_limit_mb=1000 -max_len=65536 -print_final_stats=1 -artifact_prefix="crash-$1-" >"$1.log" 2>&1 || status=$?
    runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$1.log")
    covered=$(grep -o 'cov: [0-9]*' "$1.log" | tail -n 1)
    printf '%-16s %12s runs, %s, %s\n' "$1" "${runs:-?}" "${covered:-cov: ?}" \
        "$([ $status -eq 0 ] && echo "no fault" || echo "FAULT: build/fuzz/$1.log")"
    return $status
}
export -f fuzz_one
printf '%s\n' "$@" | xargs -P "$jobs" -I{} bash -c 'fuzz_one {}'
