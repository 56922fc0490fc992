#!/usr/bin/env bash
# Runs the native tests (release and asan builds) and the Python tests, and closes with their sum:
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

printf '\n== Python tests\n'
.venv/bin/python -m pytest -rs --junitxml "$results/pytest.xml" || status=1

printf '\n'
.venv/bin/python scripts/sum_test_results.py "$results"/*.xml || status=1
exit $status
