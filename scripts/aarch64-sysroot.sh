#!/usr/bin/env bash
# Makes .deps/aarch64-sysroot: Debian's arm64 packages that the aarch64 build needs (OpenCV, GoogleTest, headers), and Python,
# unpacked but not installed. cmake/aarch64.cmake builds against it and qemu-aarch64 runs programs in it.
#
#   scripts/aarch64-sysroot.sh
#
# Needs no root and changes nothing of the system: apt works in a folder of its own with the system's package sources,
# and checks the packages by Debian's signatures. About 150 MB are fetched, once; remove the folder to fetch them anew.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
    "") ;;
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 0 ;;
    *) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac

packages=(libc6 libstdc++6 libgtest-dev libgmock-dev nlohmann-json3-dev libcli11-dev
    libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-videoio-dev
    libturbojpeg0-dev libpng-dev libwebp-dev libvpx-dev libxxhash-dev)
sysroot="$PWD/.deps/aarch64-sysroot"
stamp="$sysroot/.ready"
# The stamp is written last and holds what made the folder, so an interrupted or older one is made again.
made_by="$(sha256sum <"$0")"
[ "$(cat "$stamp" 2>/dev/null || true)" = "$made_by" ] && exit 0

for tool in apt-get dpkg-deb; do
    command -v "$tool" >/dev/null || {
        echo "$tool is missing: the aarch64 sysroot is made of Debian packages, on Debian or Ubuntu." >&2
        exit 1
    }
done

work="$PWD/.deps/aarch64-apt"
rm -rf "$sysroot" "$work"
mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$sysroot"
touch "$work/status"
apt=(apt-get -qq
    -o APT::Architecture=arm64 -o APT::Architectures::=arm64
    -o Dir::State::status="$work/status" -o Dir::State::lists="$work/lists" -o Dir::Cache="$work/cache"
    -o Debug::NoLocking=true -o APT::Sandbox::User= -o Acquire::Languages=none
    -o Acquire::IndexTargets::deb::DEP-11::DefaultEnabled=false
    -o APT::Install-Recommends=false -o APT::Keep-Downloaded-Packages=true)
echo "Fetching Debian's arm64 packages of OpenCV and GoogleTest (150 MB, once)"
"${apt[@]}" update
"${apt[@]}" --download-only install "${packages[@]}" </dev/null
for package in "$work"/cache/archives/*.deb; do
    case "${package##*/}" in
        libc6-dev_* | linux-libc-dev_* | libcrypt-dev_*) ;;  # the cross compiler brings its own
        libllvm15_* | libgl1-mesa-dri_*) ;;                  # 130 MB for drawing on a screen, which nothing here does
        *) dpkg-deb --extract "$package" "$sysroot" ;;
    esac
done

# Debian chooses between several makers of these libraries when a package is installed, which nothing here is.
libraries="$sysroot/usr/lib/aarch64-linux-gnu"
for library in blas lapack; do
    [ -e "$libraries/lib$library.so.3" ] || ln -s "$library/lib$library.so.3" "$libraries/lib$library.so.3"
done

# ONNX Runtime asks Linux about the processor. Under qemu it would read about the real one, of another architecture,
# and crash; qemu looks into this folder first. The text tells of a Cortex-A72, the plainest processor that is emulated:
# of some newer ones ONNX Runtime takes it that they have dot products, whatever the emulator says.
mkdir -p "$sysroot/proc" "$sysroot/sys/devices/system/cpu"
for cpu in 0 1; do
    printf 'processor\t: %d\nBogoMIPS\t: 100.00\nFeatures\t: fp asimd\n' $cpu
    printf 'CPU implementer\t: 0x41\nCPU architecture: 8\nCPU variant\t: 0x0\nCPU part\t: 0xd08\nCPU revision\t: 3\n\n'
done >"$sysroot/proc/cpuinfo"

rm -rf "$work"
printf '%s\n' "$made_by" >"$stamp"
