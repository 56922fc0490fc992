#!/usr/bin/env bash
# Runs the camera tests: boots Debian's kernel in qemu, with test cameras, and programs against them.
#
#   tests/camera_vm/run.sh [vivid|uvc|sdk|libcamera|metrics]...      default: all; the last three need `make build`
#
# In the environment, FRAMES: how many frames "metrics" takes from each camera (100).
# Closes with "N passed, N failed"; results also in build/test-results/camera-vm.xml (JUnit), what the kernel said in
# build/camera-vm. Exit status 77: it could not be run, and the last line says why.
set -euo pipefail
cd "$(dirname "$0")/../.."
usage() { sed -n '2,9s/^# \{0,1\}//p' "$0"; }

guests=(vivid uvc sdk libcamera metrics)
frames="${FRAMES:-100}"
limit_s=$((900 + frames / 2))  # for one guest; each takes up to two minutes where nothing else runs
work=build/camera-vm
report=build/test-results/camera-vm.xml

for argument in "$@"; do
    case "$argument" in
        -h | --help) usage; exit 0 ;;
        vivid | uvc | sdk | libcamera | metrics) ;;
        *) usage >&2; exit 2 ;;
    esac
done
[ $# -eq 0 ] || guests=("$@")

mkdir -p "$work" "$(dirname "$report")"
rm -f "$report"

not_run() {
    printf '<testsuite name="camera_vm"><testcase name="camera_vm"><skipped message="%s"/></testcase></testsuite>\n' \
        "$1" >"$report"
    echo "not run: $1"
    exit 77
}

[ "$(uname -m)" = x86_64 ] || not_run "the virtual machine runs x86-64 programs, and this is $(uname -m)"
scripts/install-packages.sh camera-vm || not_run "qemu-system-x86, busybox-static or v4l-utils could not be installed"
for tool in qemu-system-x86_64 busybox cpio v4l2-ctl cc; do
    command -v "$tool" >/dev/null || not_run "$tool is missing"
done
qemu-system-x86_64 -accel help | grep -qx tcg || not_run "this qemu cannot emulate a processor (no accelerator tcg)"
tests/camera_vm/fetch-guest.sh || not_run "Debian's kernel could not be fetched"

for program in capture virtual_uvc_camera; do
    cc -std=c99 -Wall -Wextra -Werror -O2 -static -o "$work/$program" "tests/camera_vm/$program.c"
done
cc -std=c11 -Wall -Wextra -Werror -O2 -shared -fPIC -I sdk/include -o "$work/count_allocations.so" \
    benchmarks/count_allocations.c

# Packs the files of each guest; its script is guest-NAME.sh.
pack() {
    local contents=(--file "tests/camera_vm/guest-$1.sh=test.sh"
        --program "$work/capture" --program "$(command -v v4l2-ctl)")
    case "$1" in
        vivid) contents+=(--module vivid) ;;
        uvc) contents+=(--module vhci-hcd --module uvcvideo --program "$work/virtual_uvc_camera"
            --file tests/media/photo.jpg=photo.jpg) ;;
        sdk)
            cc -std=c99 -Wall -Wextra -Werror -O2 -Isdk/include tests/camera_vm/dma_buf.c -o "$work/dma_buf" \
                -Lbuild/release/stage/lib -lmaquette
            cc -std=c99 -Wall -Wextra -Werror -O2 -Isdk/include tests/camera_vm/depth_check.c -o "$work/depth_check" \
                -Lbuild/release/stage/lib -lmaquette -lm
            contents+=(--module vivid --module vhci-hcd --module uvcvideo --program "$work/virtual_uvc_camera"
                --program "$work/dma_buf" --program "$work/depth_check" --file tests/media/photo.jpg=photo.jpg
                --tree build/release/stage=/opt/maquette) ;;
        libcamera)
            [ -e build/release/stage/lib/maquette/libmaquette_libcamera.so ] || {
                echo "This build has no libcamera: cameras: cmake --preset release && make build (libcamera-dev)." >&2
                return 1
            }
            cc -std=c11 -Wall -Wextra -Werror -O2 -o "$work/source_check" tests/camera_vm/source_check.c \
                -Isdk/include -Lbuild/release/stage/lib -lmaquette
            contents+=(--module vhci-hcd --module uvcvideo --program "$work/virtual_uvc_camera"
                --program "$work/source_check" --program "$(command -v cam)" --program "$(command -v udevadm)"
                --file tests/media/photo.jpg=photo.jpg --tree build/release/stage=/opt/maquette) ;;
        metrics) contents+=(--module vivid --module vhci-hcd --module uvcvideo --program "$work/virtual_uvc_camera"
            --file "$work/count_allocations.so=count_allocations.so" --tree build/release/stage=/opt/maquette) ;;
    esac
    tests/camera_vm/make-initramfs.sh "$work/$1.cpio" "${contents[@]}"
}

# boot NAME: its results, one a line, on standard output. The image is unpacked into memory, beside the image itself.
boot() {
    local kernel memory_mb processor=(-accel tcg,thread=multi -smp 2)
    # An instruction takes a nanosecond and waiting takes none of ours: however busy this machine is, times in the guest
    # come out alike.
    [ "$1" != metrics ] || processor=(-accel tcg,thread=single -icount "shift=0,sleep=off" -smp 1)
    kernel="$(echo .deps/camera-vm/root/boot/vmlinuz-*)"
    memory_mb=$((512 + 3 * $(stat -c %s "$work/$1.cpio") / 1048576))
    timeout "$limit_s" qemu-system-x86_64 "${processor[@]}" -cpu max -m "$memory_mb" \
        -nodefaults -no-reboot -display none -serial "file:$work/$1-kernel.log" -serial stdio \
        -kernel "$kernel" -initrd "$work/$1.cpio" -append "console=ttyS0 panic=-1 frames=$frames" </dev/null |
        tr -d '\r'
}

# Reads `ok NAME` and `not ok NAME: why` and writes test cases of JUnit.
to_junit() {
    sed -e 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g; s/"/\&quot;/g' "$@" | awk '
        /^ok / { printf "<testcase classname=\"camera_vm\" name=\"%s\"/>\n", substr($0, 4) }
        /^not ok / {
            name = substr($0, 8); why = ""
            if (at = index(name, ": ")) { why = substr(name, at + 2); name = substr(name, 1, at - 1) }
            printf "<testcase classname=\"camera_vm\" name=\"%s\"><failure message=\"%s\"/></testcase>\n", name, why
        }'
}

results=()
for guest in "${guests[@]}"; do
    printf '\n== %s\n' "$guest"
    pack "$guest"
    start=$SECONDS
    result="$work/$guest.txt"
    results+=("$result")
    status=0
    boot "$guest" | tee "$result" || status=$?
    if ! grep -q '^# the guest is done' "$result"; then
        why="qemu ended with status $status"
        [ "$status" -ne 124 ] || why="it took more than $limit_s s"
        echo "not ok $guest reaches its end: $why; see $work/$guest-kernel.log" | tee -a "$result"
    fi
    echo "# $((SECONDS - start)) s"
done

{
    echo '<testsuite name="camera_vm">'
    to_junit "${results[@]}"
    echo '</testsuite>'
} >"$report"
passed=$(cat "${results[@]}" | grep -c '^ok ' || true)
failed=$(cat "${results[@]}" | grep -c '^not ok ' || true)
printf '\n%d passed, %d failed\n' "$passed" "$failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
