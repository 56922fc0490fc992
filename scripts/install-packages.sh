#!/usr/bin/env bash
# Installs the Debian packages that groups of make targets need, and only those that are missing.
#
#   scripts/install-packages.sh demo        to build the SDK and run it
#   scripts/install-packages.sh desktop     + the desktop demo
#   scripts/install-packages.sh test        + the native tests, Python, a display and OpenGL in software
#   scripts/install-packages.sh isa         + to build for aarch64 and to run other processors' programs (70 MB)
#   scripts/install-packages.sh camera-vm   + a virtual machine with Linux's test camera drivers (35 MB)
#   scripts/install-packages.sh lint        + clang-format and clang-tidy
#   scripts/install-packages.sh fuzz        + Clang with libFuzzer (test, too)
#   scripts/install-packages.sh android     to build the SDK, and: Java, Maven, a compiler and linker for Android (350 MB)
#   scripts/install-packages.sh wheel       to build the SDK, and: what builds codecs from source
#   scripts/install-packages.sh windows     to build the SDK, and: a compiler for Windows, what builds codecs, Wine (1.2 GB)
#   scripts/install-packages.sh web         to build the SDK, and: emscripten (650 MB), and Chromium, to test it
#   scripts/install-packages.sh newcomer    + debootstrap, which makes a bare Debian, and qemu for one of arm64
#   scripts/install-packages.sh release     to pack and check a release: debhelper, lintian, minisign
#   scripts/install-packages.sh site        to build the site: Doxygen, Maven; and Chromium, to test it
#   scripts/install-packages.sh test lint   what both need, at once
#
# Says what it is going to install before it does, asks sudo when not root, and fails when a package cannot be had.
set -euo pipefail

usage() { sed -n '2,19s/^# \{0,1\}//p' "$0"; }

for group in "${@:-}"; do
    case "$group" in
        demo | desktop | test | isa | camera-vm | lint | fuzz | android | newcomer | wheel | windows | web | release | site) ;;
        -h | --help) usage; exit 0 ;;
        *) usage >&2; exit 2 ;;
    esac
done
# wants GROUP...: whether one of them is asked for.
wants() {
    local asked group
    for asked in "${groups[@]}"; do
        for group; do [ "$asked" != "$group" ] || return 0; done
    done
    return 1
}
groups=("$@")

if ! command -v dpkg-query >/dev/null; then
    echo "This is not a Debian system, so nothing is installed: see the package list in $0." >&2
    exit 0
fi

missing=()
# needs_command COMMAND PACKAGE: a tool counts as present however it was installed.
needs_command() { command -v "$1" >/dev/null || missing+=("$2"); }
needs_package() {
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null || true)" = installed ] || missing+=("$1")
}

needs_command g++ g++
needs_command cmake cmake
needs_command ninja ninja-build
needs_command pkg-config pkg-config
needs_command npm npm                  # brings ONNX Runtime: headers, and the library for x86-64
[ "$(uname -m)" = x86_64 ] || needs_command mvn maven  # ... and the library for other machines
needs_package nlohmann-json3-dev
needs_package libcli11-dev
needs_package libturbojpeg0-dev
needs_package libpng-dev
needs_package libwebp-dev
needs_package libvpx-dev
needs_command ffmpeg ffmpeg            # reads clips
needs_package libxxhash-dev
needs_package ca-certificates
# make-venv.sh needs a Python that can create environments.
"${PYTHON:-python3}" -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3-venv)

if wants desktop test isa camera-vm lint fuzz android newcomer; then
    needs_package libglfw3-dev
    needs_package libepoxy-dev
    needs_package libimgui-dev
fi
if wants test isa camera-vm lint fuzz android newcomer; then
    needs_command git git
    needs_command ccache ccache       # what was compiled in another checkout is not compiled again
    needs_command assimp assimp-utils  # a reader of heads that is not ours
    for module in core imgproc imgcodecs videoio; do needs_package "libopencv-$module-dev"; done
    needs_package libgtest-dev
    needs_package libgmock-dev
    needs_package libcamera-dev       # without it the SDK is built without libcamera: cameras
    needs_package python3-dev
    needs_command strace strace       # shows that nothing is sent anywhere
    needs_package libegl1             # moderngl draws without a window through EGL
    needs_package libgl1
    needs_package libgl1-mesa-dri     # ... on the processor (llvmpipe)
    needs_command Xvfb xvfb           # a display for the desktop demo
    needs_command xauth xauth         # ... which xvfb-run needs to start it
fi
if wants isa; then
    needs_command qemu-aarch64 qemu-user
    needs_command aarch64-linux-gnu-g++ g++-aarch64-linux-gnu
    needs_command mvn maven           # brings ONNX Runtime for aarch64
fi
if wants camera-vm; then
    needs_command qemu-system-x86_64 qemu-system-x86
    needs_package busybox-static      # static: the virtual machine has no libraries but those packed
    needs_command cpio cpio
    needs_package kmod                # its programs are not in the PATH of users
    needs_command v4l2-ctl v4l-utils
    needs_command cam libcamera-tools
    needs_command udevadm udev
fi
if wants windows; then
    needs_command x86_64-w64-mingw32-g++-posix g++-mingw-w64-x86-64-posix
    needs_package wine64
fi
if wants wheel windows; then
    needs_command dpkg-source dpkg-dev
    needs_command nasm nasm
    needs_command autoreconf autoconf
    needs_command libtoolize libtool
fi
if wants lint; then
    needs_command clang-format clang-format
    needs_command clang-tidy clang-tidy
fi
if wants fuzz android; then
    needs_command clang++-14 clang-14
fi
! wants fuzz || needs_package libclang-rt-14-dev  # libFuzzer and sanitizers
if wants android; then
    needs_command javac openjdk-17-jdk-headless
    needs_command mvn maven           # brings Kotlin, and Android's classes to test against
    needs_command ld.lld-14 lld-14
    needs_package libc++-14-dev       # headers; the library is Android's
    needs_command unzip unzip
    needs_command python3 python3
    needs_package python3-pip         # brings headers of a C library like Android's
fi
if wants newcomer; then
    needs_command debootstrap debootstrap
    needs_command qemu-aarch64-static qemu-user-static
fi
if wants web; then
    needs_command emcc emscripten
    needs_package node-acorn          # emscripten needs it, and Debian only recommends it where node is another one
    needs_command chromium chromium   # shows the page to the tests
fi
if wants site; then
    needs_command doxygen doxygen
    needs_command javac openjdk-17-jdk-headless
    needs_command mvn maven           # brings Dokka
    needs_command chromium chromium   # shows a page to the tests
fi
if wants release; then
    needs_command dh debhelper
    needs_command help2man help2man
    needs_command lintian lintian
    needs_command minisign minisign
fi

[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "Missing Debian packages: ${missing[*]}" >&2
        echo "Install them as root (apt-get install ${missing[*]}) and run make again." >&2
        exit 1
    fi
    as_root=(sudo env DEBIAN_FRONTEND=noninteractive)
fi
exec 9<"$0"  # one at a time: groups of tests run beside each other, and apt refuses when another one is at work
flock 9
echo "Installing Debian packages: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive  # sudo passes nothing on
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
