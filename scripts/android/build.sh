#!/usr/bin/env bash
# Builds the AAR where there is no NDK, as far as that goes, and checks it:
#
#   scripts/android/build.sh [JOBS] [ABI...]      default: all processors, and the ABIs arm64-v8a and x86_64
#
# Compiles and links the SDK and its Java side for each ABI with Debian's clang (cmake/android-check.cmake),
# several files as one, a third of the time (tests/python/project/test_standard_headers.py finds the header one lacks);
# the Kotlin API with Maven, and its classes to Android's own bytecode with D8; assembles
# build/android/maquette-VERSION.aar with a report of its size beside it. Nothing of it was run on Android. What is
# released is built by Gradle with the NDK (android/README.md).
set -euo pipefail
cd "$(dirname "$0")/../.."
jobs="${1:-$(nproc)}"
abis=("${@:2}")
[ ${#abis[@]} -gt 0 ] || abis=(arm64-v8a x86_64)
case "$jobs" in
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' scripts/android/build.sh; exit 0 ;;
    '' | *[!0-9]*) sed -n '2,11s/^# \{0,1\}//p' scripts/android/build.sh >&2; exit 2 ;;
esac

scripts/android/sysroot.sh
launcher=()
if command -v ccache >/dev/null; then
    export CCACHE_BASEDIR="$PWD" CCACHE_NOHASHDIR=1
    launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
native=()
for abi in "${abis[@]}"; do
    echo "== Native code for $abi"
    folder="build/android/$abi"
    cmake -G Ninja -S android/maquette/src/main/cpp -B "$folder" -DCMAKE_BUILD_TYPE=Release --log-level=WARNING \
        -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/android-check.cmake" -DANDROID_ABI="$abi" -DMAQ_WARNINGS_AS_ERRORS=ON \
        -DMAQ_UNITY=ON -DMAQ_UNITY_FILES=16 \
        ${launcher[@]+"${launcher[@]}"}
    cmake --build "$folder" -j "$jobs" -- --quiet
    native+=(--native "$abi" "$folder"/{libmaquette_jni,sdk/stage/lib/libmaquette,libmaquetteort}.so
        ".deps/android-sysroot/lib/$abi/libc++_shared.so")
done

echo "== Kotlin API"
# jar COORDINATES: its place in Maven's own folder, fetched once.
jar() {
    local group name version
    IFS=: read -r group name version <<<"$1"
    local file="$HOME/.m2/repository/${group//./\/}/$name/$version/$name-$version.jar"
    [ -e "$file" ] || mvn --batch-mode --quiet org.apache.maven.plugins:maven-dependency-plugin:3.8.1:get \
        -Dtransitive=false "-Dartifact=$1" >&2
    echo "$file"
}
rm -rf build/android-tests/classes  # else classes that were renamed or moved since stay, and go into the AAR
mvn --batch-mode --quiet -f tests/android/pom.xml compile
version="$(sed -n 's/^project(maquette VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)"
property() { sed -n "s/.*<$1>\(.*\)<\/$1>.*/\1/p" tests/android/pom.xml; }
dependencies=("org.jetbrains.kotlin:kotlin-stdlib:$(property kotlin.version)"
    "org.jetbrains.kotlinx:kotlinx-coroutines-core-jvm:$(property coroutines.version)")
libraries=()
for dependency in "${dependencies[@]}"; do libraries+=(--classpath "$(jar "$dependency")"); done
d8="java -cp $(jar com.android.tools:r8:9.5.28) com.android.tools.r8.D8 --min-api 26"
d8+=" --lib $(jar "org.robolectric:android-all:$(property android.all)") ${libraries[*]}"
"${PYTHON:-python3}" scripts/android/aar.py --classes build/android-tests/classes --d8 "$d8" --version "$version" \
    "${native[@]}" "${dependencies[@]/#/--dependency=}" --out build/android \
    --junit build/test-results/android-aar.xml
