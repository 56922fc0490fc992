#!/usr/bin/env bash
# Checks that processors of other kinds give the same answers as this one, which qemu emulates:
#
#   scripts/test-isa.sh [JOBS] [core]
#
# Builds for aarch64, runs the native tests there, and compares the labels, the edges and the prediction of the shipped
# bundles on x86-64 with AVX2 but without VNNI, and on aarch64 with and without dot product, with those on this
# processor. Needs build/release. core: aarch64 only, the tests of files, images and dense pose, labels and edges; when
# they have passed with the same sources, compiler and emulator on this machine before, in whatever checkout, that
# result counts.
# Exit status 77: it could not be run, and the last line says why.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs="${1:-$(nproc)}" part="${2:-all}"
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
    -h | --help) sed -n '2,12s/^# \{0,1\}//p' "$0"; exit 0 ;;
    '' | *[!0-9]*) sed -n '2,12s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac
case "$part" in all | core) ;; *) sed -n '2,12s/^# \{0,1\}//p' "$0" >&2; exit 2 ;; esac
[ "$(uname -m)" = x86_64 ] || not_run "it emulates other processors from x86-64, and this is $(uname -m)"
[ -x build/release/stage/bin/maquette ] || not_run "the release build is missing (make build)"
scripts/install-packages.sh isa || not_run "qemu-user, g++-aarch64-linux-gnu or maven could not be installed"
for tool in qemu-aarch64 qemu-x86_64 aarch64-linux-gnu-g++ mvn; do
    command -v "$tool" >/dev/null || not_run "$tool is missing"
done
if [ "$part" = core ]; then
    inputs=(CMakeLists.txt CMakePresets.json cmake sdk tests/native tests/media benchmarks/processors
        benchmarks/native/processor_features.c scripts/aarch64-sysroot.sh scripts/test-isa.sh)
    hash="$({ git ls-files -co --exclude-standard -z "${inputs[@]}" | xargs -0 sha256sum
        aarch64-linux-gnu-g++ --version; qemu-aarch64 --version; } | sha256sum | cut -c1-32)"
    passed="${XDG_CACHE_HOME:-$HOME/.cache}/maquette/isa-core/$hash"
    if [ -d "$passed" ]; then
        cp "$passed"/isa-*.xml "$results"
        echo "aarch64: passed before with the same sources, compiler and emulator ($passed)"
        exit 0
    fi
fi
scripts/aarch64-sysroot.sh || not_run "the arm64 packages of Debian could not be fetched"

log=build/aarch64-configure.log
others=ON
[ "$part" != core ] || others=OFF  # the systems whose tests are not run
if ! cmake --preset aarch64 -DMAQ_BUILD_TESTS=ON -DMAQ_WITH_{SCENES,HEADS,PREDICTION}=$others 2>&1 | tee "$log"; then
    if grep -q 'could not be fetched' "$log"; then not_run "ONNX Runtime for aarch64 could not be fetched"; fi
    exit 1
fi
status=0
if [ "$part" = core ]; then
    folders=(core image nn densepose)
    cmake --build --preset aarch64 -j "$jobs" --target maquette_cli processor_features \
        native_core_tests native_image_tests native_nn_tests native_densepose_tests
    printf '\n== native tests of files, images and dense pose, aarch64 under qemu\n'
    for folder in "${folders[@]}"; do  # shipped networks: the labels below
        MAQ_ONNXRUNTIME_LIB="" MAQ_BUNDLE="" qemu-aarch64 -L .deps/aarch64-sysroot \
            "build/aarch64/tests/native/native_${folder}_tests" --gtest_brief=1 --gtest_filter='-ShippedNetworks.*' \
            --gtest_output="xml:$PWD/$results/isa-$folder.xml" || status=1
    done
    printf '\n== labels of the bundled pictures, and edges of rendered solids, on aarch64\n'
    for what in label field; do
        .venv/bin/python -m "benchmarks.processors.${what}_agreement" --jobs "$jobs" --only asimd --only asimddp \
            --junit "$results/isa-$what.xml" || status=1
    done
    if [ $status -eq 0 ]; then
        mkdir -p "$passed.$$" && cp "$results"/isa-*.xml "$passed.$$" && mv -T "$passed.$$" "$passed"
    fi
    exit $status
fi

cmake --build --preset aarch64 -j "$jobs"
printf '\n== native tests, aarch64 under qemu\n'
echo "Left out: programs of users, which this machine's compiler builds, and what CMake named above."
ctest --test-dir build/aarch64 -j "$jobs" --output-on-failure --no-tests=error \
    --output-junit "$PWD/$results/isa-ctest-aarch64.xml" || status=1

printf '\n== labels, edges and prediction on other processors (emulated: some minutes)\n'
for what in label field prediction; do
    .venv/bin/python -m "benchmarks.processors.${what}_agreement" --jobs "$jobs" --junit "$results/isa-$what.xml" || status=1
done
exit $status
