#!/usr/bin/env bash
# run.sh SECONDS: each target from the small good files of the tests. Inputs that break one stay in build/fuzz.
set -eu
cd "$(dirname "$0")/../../.."
data=$PWD/tests/native/data/tiny_head
programs=$PWD/build/fuzz/tests/native/fuzz
cd build/fuzz
failed=0
run() {
    echo "$1"
    "$programs/$@" || failed=1
}
seed=$(date +%s)
run fuzz_head_file --seconds "$1" --seed "$seed" "$data/example.maqh"
run fuzz_prior_file --seconds "$1" --seed "$seed" "$data"/priors/*.maqp
run fuzz_template_file --seconds "$1" --seed "$seed" "$data/template.maqt"
exit $failed
