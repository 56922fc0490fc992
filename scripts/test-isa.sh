#!/usr/bin/env bash
# Checks that processors of other kinds give the same answers as this one, which qemu emulates:
#
#   scripts/test-isa.sh [JOBS]
#
# Builds for aarch64, runs the native tests there, and compares the labels of the shipped bundle on x86-64 with AVX2 but
# without VNNI, and on aarch64 with and without dot product, with those on this processor. Needs build/release.
# Exit status 77: it could not be run, and the last line says why.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs="${1:-$(nproc)}"
results=build/test-results
mkdir -p "$results"
rm -f "$results"/isa-*.xml

not_run() {
    printf '<testsuite name="isa"><testcase name="isa"><skipped message="%s"/></testcase></testsuite>\n' "$1" \
        >"$results/isa-not-run.xml"
    echo "not run: $1"
    exit 77
}

case "$jobs" in
    -h | --help) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 0 ;;
    '' | *[!0-9]*) sed -n '2,9s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac
[ "$(uname -m)" = x86_64 ] || not_run "it emulates other processors from x86-64, and this is $(uname -m)"
[ -x build/release/stage/bin/maquette ] || not_run "the release build is missing (make build)"
scripts/install-packages.sh isa || not_run "qemu-user-static, g++-aarch64-linux-gnu or maven could not be installed"
for tool in qemu-aarch64-static qemu-x86_64-static aarch64-linux-gnu-g++ mvn; do
    command -v "$tool" >/dev/null || not_run "$tool is missing"
done
scripts/aarch64-sysroot.sh || not_run "the arm64 packages of Debian could not be fetched"

log=build/aarch64-configure.log
if ! cmake --preset aarch64 -DMAQ_BUILD_TESTS=ON 2>&1 | tee "$log"; then
    if grep -q 'could not be fetched' "$log"; then not_run "ONNX Runtime for aarch64 could not be fetched"; fi
    exit 1
fi
cmake --build --preset aarch64 -j "$jobs"

status=0
printf '\n== native tests, aarch64 under qemu\n'
echo "Left out: programs of users, which this machine's compiler builds, and what CMake named above."
ctest --test-dir build/aarch64 -j "$jobs" --output-on-failure --no-tests=error \
    --output-junit "$PWD/$results/isa-ctest-aarch64.xml" || status=1

printf '\n== labels on other processors (emulated: some minutes)\n'
.venv/bin/python -m benchmarks.label_agreement --jobs "$jobs" --junit "$results/isa-labels.xml" || status=1
exit $status
