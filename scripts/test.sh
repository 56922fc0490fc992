#!/usr/bin/env bash
# Runs the native tests (release and asan builds; those of threads in the tsan build; some for aarch64, emulated), the
# Python tests, those of Android and those with cameras in a virtual machine, where there can be one, two groups at a
# time, and closes with their sum:
#   scripts/test.sh [GROUP...]      default: all of python camera-vm aarch64 android asan tsan release
# Needs build/release and .venv (make test); builds the others. Each group prints when it ends. Everything runs even when
# something before it failed; the exit status says whether anything did.
set -uo pipefail
cd "$(dirname "$0")/.."
results=build/test-results

# native BUILD [CTEST_OPTION...]: the native tests of one build.
native() {
    local build=$1
    shift
    ctest --test-dir "build/$build" "$@" --output-on-failure --no-tests=error \
        --output-junit "$PWD/$results/ctest-$build.xml"
}

# python_tests NAME MARKERS: the Python tests with these markers.
python_tests() {
    .venv/bin/python -m pytest -rs -m "$2" --junitxml "$results/$1.xml"
}

# build NAME...: compiles asan, tsan.
build() {
    local name targets
    for name in "$@"; do
        targets=()
        [ "$name" = asan ] || targets=(--target thread_tests)
        { cmake --preset "$name" -DMAQ_BUILD_TESTS=ON &&
            cmake --build --preset "$name" -j "${JOBS:-$(nproc)}" "${targets[@]}" && touch "$results/$name.built"
        } >"$results/$name-build.log" 2>&1
    done
}

# built NAME: waits for that, and fails with what the compiler said when it could not be built.
built() {
    while kill -0 "$builder" 2>/dev/null && [ ! -e "$results/$1.built" ]; do sleep 1; done
    [ -e "$results/$1.built" ] || { tail -n 60 "$results/$1-build.log"; return 1; }
}

# group NAME: runs one group and prints its title, its output and its time at its end, unmixed with the other's.
group() {
    local status=0 log="$results/$1.log"
    {
        printf '\n== %s\n' "$1"
        case "$1" in
            python) python_tests pytest "not asan_build" ;;
            camera-vm) tests/camera_vm/run.sh ;;
            aarch64) scripts/test-isa.sh 1 core ;;
            android) scripts/android/build.sh 1 && scripts/android/test.sh ;;
            asan)
                built asan && { native asan || status=$?; } && python_tests pytest-asan asan_build && [ "$status" -eq 0 ]
                ;;
            tsan) built tsan && native tsan -L threads ;;
            *) native "$1" ;;
        esac
    } >"$log" 2>&1 || status=$?
    flock "$results" cat "$log"
    echo "# $1 took $SECONDS s"
    case "$1 $status" in "camera-vm 77" | "aarch64 77") status=0 ;; esac  # it said why it could not be run
    [ "$status" -eq 0 ] || touch "$results/failed"
}

case "${1:-}" in
    --group) group "$2"; exit ;;
    --build) build "${@:2}"; exit ;;
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 0 ;;
esac
# The longest first, but for those that are compiled meanwhile. Java of android not beside the virtual machine, whose
# emulated cameras time out when they starve.
[ $# -gt 0 ] || set -- python camera-vm aarch64 android asan tsan release
sanitized=()
for name in "$@"; do
    case "$name" in
        python | camera-vm | aarch64 | android | release) ;;
        asan | tsan) sanitized+=("$name") ;;
        *) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
    esac
done
rm -rf "$results"
mkdir -p "$results"
# Compilers take what the tests leave of the processors while they wait for frames, for a guest that boots, for a network.
nice -n 10 "$0" --build ${sanitized[@]+"${sanitized[@]}"} &
export builder=$!
printf '%s\n' "$@" | xargs -P 2 -n 1 "$0" --group
wait

printf '\n'
.venv/bin/python scripts/sum_test_results.py "$results"/*.xml || touch "$results/failed"
[ ! -e "$results/failed" ]
