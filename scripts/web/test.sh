#!/usr/bin/env bash
# Tests the npm package in node and the page in Chromium, after scripts/web/build.sh:
#
#   scripts/web/test.sh [RESULTS]      a JUnit report goes to build/web/tests, and to the folder RESULTS if it is given
set -euo pipefail
cd "$(dirname "$0")/../.."
results=build/web/tests
rm -rf "$results"
mkdir -p "$results"
(cd tests/web && npm install --silent --no-audit --no-fund)
status=0
node --test --test-concurrency=1 --test-reporter=spec --test-reporter-destination=stdout \
    --test-reporter=junit --test-reporter-destination="$results/web.xml" tests/web/*.test.js || status=$?
[ -z "${1:-}" ] || cp "$results/web.xml" "$1"
python3 scripts/sum_test_results.py "$results"
exit $status
