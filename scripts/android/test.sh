#!/usr/bin/env bash
# Tests of the Kotlin API (tests/android) with the library in build/release. Fails, too, where our native methods misuse
# JNI; what Robolectric's own do is not ours.
set -euo pipefail
cd "$(dirname "$0")/../.."

log=build/android-tests.log reports=build/android-tests/surefire-reports
rm -rf "$reports"
status=0
mvn --batch-mode --quiet -f tests/android/pom.xml test >"$log" 2>&1 || { tail -n 60 "$log" >&2; status=1; }
[ -d "$reports" ] || exit 1  # it was not compiled
# A warning of -Xcheck:jni is followed by the stack, the native method first.
awk '/WARNING in native method/ { warned = 1; next }
     warned && /\tat / { if (/at dev\.maquette\./) { print FILENAME ": JNI is misused" $0; bad = 1 } warned = 0 }
     END { exit bad }' "$log" $(find "$reports" -name '*.dumpstream') >&2 || status=1
results=build/test-results
mkdir -p "$results"
for report in "$reports"/TEST-*.xml; do cp "$report" "$results/android-${report##*/TEST-}"; done
cat "$reports"/*.txt | awk -F'[:,]' '
    /^Tests run/ { run += $2; failed += $4 + $6; skipped += $8 }
    END { printf "%d passed, %d failed, %d skipped\n", run - failed - skipped, failed, skipped; exit failed > 0 || run == 0 }' || status=1
exit $status
