#!/usr/bin/env bash
# Makes .deps/android-sysroot, with which clang compiles and links for Android where there is no NDK, as a check
# (cmake/android-check.cmake):
#
#   scripts/android/sysroot.sh
#
# Headers of the C library are musl's, out of the wheel of ziglang; those of Android and JNI are Debian's; the C++
# library is the NDK's, out of the AAR of fbjni. Link stubs of Android's own libraries are made of what official Android
# libraries import, so that a function which none of them uses is an error, unless tests/android/bionic.txt has it.
# About 105 MB are fetched, once; remove the folder to fetch them anew.
set -euo pipefail
cd "$(dirname "$0")/../.."
case "${1:-}" in
    "") ;;
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' scripts/android/sysroot.sh; exit 0 ;;
    *) sed -n '2,11s/^# \{0,1\}//p' scripts/android/sysroot.sh >&2; exit 2 ;;
esac

sysroot="$PWD/.deps/android-sysroot"
stamp="$sysroot/.ready"
# The stamp is written last and holds what made the folder, so an interrupted or older one is made again.
made_by="$(cat scripts/android/sysroot.sh scripts/android/link_stubs.py tests/android/bionic.txt | sha256sum)"
[ "$(cat "$stamp" 2>/dev/null || true)" = "$made_by" ] && exit 0

onnxruntime="$(compgen -G "$PWD/.deps/onnxruntime-*/android/jni" | head -n 1)" || {
    echo "ONNX Runtime for Android is not in .deps yet: run make build." >&2
    exit 1
}

work="$PWD/.deps/android-sysroot-work"
rm -rf "$sysroot" "$work"
mkdir -p "$sysroot/include" "$work"
downloads="$PWD/.deps/android-downloads"
mkdir -p "$downloads"

echo "Fetching headers and libraries to check builds for Android (105 MB, once)"
ziglang=ziglang-0.17.0-py3-none-manylinux_2_12_x86_64.manylinux2010_x86_64.musllinux_1_1_x86_64.whl
[ -e "$downloads/$ziglang" ] || "${PYTHON:-python3}" -m pip download -q --no-deps --dest "$downloads" \
    --only-binary :all: --platform manylinux2010_x86_64 ziglang==0.17.0
fbjni=fbjni-0.7.0.aar
[ -e "$downloads/$fbjni" ] || mvn --batch-mode --quiet org.apache.maven.plugins:maven-dependency-plugin:3.8.1:copy \
    -Dartifact=com.facebook.fbjni:fbjni:0.7.0:aar "-DoutputDirectory=$downloads"
(cd "$downloads" && sha256sum --quiet --check) <<EOF
97079827064a7492cce5541ceb438ae8003ce1e54e399676da2d62fb7a5dc08b  $ziglang
7e319ae110ac5e5ef18904170aea5c3e753e915d196699d7fd39d36c8e1dfe36  $fbjni
EOF
debian=(android-liblog-dev android-platform-frameworks-native-headers android-libnativehelper-dev)
(cd "$work" && apt-get -qq -o APT::Sandbox::User= download "${debian[@]}")

for folder in aarch64-linux-musl x86_64-linux-musl generic-musl aarch64-linux-any x86-linux-any any-linux-any; do
    unzip -q "$downloads/$ziglang" "ziglang/lib/libc/include/$folder/*" -d "$work"
    mv "$work/ziglang/lib/libc/include/$folder" "$sysroot/include/"
done
for package in "$work"/*.deb; do dpkg-deb --extract "$package" "$work/debian"; done
mkdir "$sysroot/include/android"
cp -r "$work/debian/usr/include/android/android" "$sysroot/include/android/"
cp "$work/debian/usr/include/android/nativehelper/jni.h" "$sysroot/include/android/"
# Libraries of headers alone.
mkdir -p "$sysroot/usr/include" "$sysroot/usr/share/cmake"
cp -r /usr/include/nlohmann /usr/include/{xxhash,zlib,zconf}.h "$sysroot/usr/include/"
cp -r /usr/share/cmake/nlohmann_json "$sysroot/usr/share/cmake/"

for abi in arm64-v8a x86_64; do
    mkdir -p "$sysroot/lib/$abi"
    unzip -q -j "$downloads/$fbjni" "jni/$abi/*" -d "$work/$abi"
    cp "$work/$abi/libc++_shared.so" "$sysroot/lib/$abi/"
    "${PYTHON:-python3}" scripts/android/link_stubs.py --abi "$abi" --out "$sysroot/lib/$abi" \
        --libraries "$work/$abi"/*.so "$onnxruntime/$abi/libonnxruntime.so" \
        --more tests/android/bionic.txt
done
rm -rf "$work"
echo "$made_by" >"$stamp"
