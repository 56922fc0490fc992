#!/usr/bin/env bash
# Runs the native tests (release and asan builds; those with threads of their own in the tsan build too), the Python tests
# and those with cameras in a virtual machine, where there can be one, and closes with their sum:
#   scripts/test.sh
# Everything runs even when something before it failed; the exit status says whether anything did.
set -uo pipefail
cd "$(dirname "$0")/.."
results=build/test-results
rm -rf "$results"
mkdir -p "$results"
status=0

for preset in release asan; do
    printf '\n== native tests, %s\n' "$preset"
    ctest --test-dir "build/$preset" --output-on-failure --no-tests=error \
        --output-junit "$PWD/$results/ctest-$preset.xml" || status=1
done

printf '\n== native tests of threads, tsan\n'
ctest --test-dir build/tsan -L threads \
    --output-on-failure --no-tests=error --output-junit "$PWD/$results/ctest-tsan.xml" || status=1

printf '\n== Python tests\n'
.venv/bin/python -m pytest -rs --junitxml "$results/pytest.xml" || status=1

printf '\n== cameras on a real kernel, in a virtual machine\n'
tests/camera_vm/run.sh
case $? in
    0 | 77) ;;  # 77: it said why it could not be run
    *) status=1 ;;
esac

printf '\n'
.venv/bin/python scripts/sum_test_results.py "$results"/*.xml || status=1
exit $status
