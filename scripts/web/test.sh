#!/usr/bin/env bash
# Tests the npm package in node and the page in Chromium, after scripts/web/build.sh:
#
#   scripts/web/test.sh [RESULTS]      a JUnit report goes to RESULTS/web.xml; default: build/web/tests
set -euo pipefail
cd "$(dirname "$0")/../.."
results=${1:-build/web/tests}
mkdir -p "$results"
results=$(realpath "$results")
(cd tests/web && npm install --silent --no-audit --no-fund)
status=0
node --test --test-concurrency=1 --test-reporter=spec --test-reporter-destination=stdout \
    --test-reporter=junit --test-reporter-destination="$results/web.xml" tests/web/*.test.js || status=$?
python3 scripts/sum_test_results.py "$results"
exit $status
