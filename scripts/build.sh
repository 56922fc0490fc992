#!/usr/bin/env bash
# Configures and builds one preset of CMakePresets.json:
#
#   scripts/build.sh PRESET [-DOPTION=VALUE...] [TARGET...]      default: all targets
#
# On a terminal ninja shows its progress. In a log there is one line when the build begins and one when it ends.
# Options that an earlier run gave stay. JOBS: compilers at a time (default: one for each core).
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in '' | -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

preset=$1
shift
options=() targets=()
for argument; do
    case "$argument" in
        -D*) options+=("$argument") ;;
        *) targets+=("$argument") ;;
    esac
done
build=(cmake --build --preset "$preset" -j "${JOBS:-$(nproc)}" ${targets[@]+--target "${targets[@]}"})

configure() { cmake --preset "$preset" "$@" ${options[@]+"${options[@]}"}; }
if [ -t 1 ]; then
    [ -f "build/$preset/build.ninja" ] && [ ${#options[@]} -eq 0 ] || configure
    exec "${build[@]}"
fi
echo "building $preset${targets[*]:+ (${targets[*]})}"
log="build/$preset-configure.log"
mkdir -p build
[ -f "build/$preset/build.ninja" ] && [ ${#options[@]} -eq 0 ] || configure >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
"${build[@]}" -- --quiet
echo "built $preset in $SECONDS s"
