#!/usr/bin/env bash
# Builds the SDK for Windows and compares its results under Wine with those of the release build, on the bundled files:
#
#   scripts/windows/test.sh [JOBS]
#
# People of the photo, a head, a scene and its views, fields of the depth image, a recording and predicted frames must be
# the same bytes; coordinates of curves may differ by 1 nm, since sines of both systems differ in a last bit. Needs build/release.
set -euo pipefail
cd "$(dirname "$0")/../.."
case "${1:-}" in -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
jobs="${1:-$(nproc)}"
here=build/release/stage/bin/maquette
[ -x "$here" ] || { echo "The release build is missing: make build" >&2; exit 1; }
wine="$(PATH="$PATH:/usr/lib/wine" command -v wine64)" || { echo "wine64 is missing: scripts/install-packages.sh windows" >&2; exit 1; }

scripts/windows/prepare.sh "$jobs"
JOBS="$jobs" scripts/build.sh windows-x86_64
stage=build/windows-x86_64/stage/bin

fail() { echo "FAILED: $*" >&2; exit 1; }
x86_64-w64-mingw32-objdump -p "$stage/maquette.dll" | grep -oE '\bmaq_[a-z0-9_]+$' | sort -u >build/windows-exports.txt
grep '^[a-z]' sdk/src/api/exports.txt | sort | diff - build/windows-exports.txt || fail "maquette.dll exports other functions"
needed="$(x86_64-w64-mingw32-objdump -p "$stage/maquette.dll" "$stage/maquette.exe" | sed -n 's/.*DLL Name: //p' | sort -fu)"
for library in $needed; do
    case "${library,,}" in
        advapi32.dll | kernel32.dll | msvcrt.dll | shell32.dll | maquette.dll) ;;
        *) fail "$library is needed, which Windows does not have or an app would have to install" ;;
    esac
done

work="$(mktemp -d)"
trap 'WINEPREFIX="$work/wine" "$(dirname "$wine")/wineserver" -k || true; rm -rf "$work"' EXIT
# Names of files need a locale with letters other than ASCII's; Wine's own messages are not of interest.
export LC_ALL=C.UTF-8 WINEPREFIX="$work/wine" WINEDEBUG=-all
"$wine" wineboot >/dev/null 2>&1  # makes its folders
cc -O1 -shared -fPIC -o "$work/amx.so" scripts/windows/amx_permission.c
windows() {
    local status=0
    LD_PRELOAD="$work/amx.so" "$wine" "$stage/maquette.exe" "$@" 2>"$work/errors.log" || status=$?
    grep -v DXGI "$work/errors.log" >&2 || true
    return $status
}
mkdir "$work/linux" "$work/windows"

# both ARGUMENT...: the command on both systems; OUT in an argument is the folder of each.
both() {
    echo "maquette $*"
    "$here" "${@//OUT/$work/linux}" >"$work/linux.log" || fail "the release build: $(cat "$work/linux.log")"
    windows "${@//OUT/$work/windows}" >"$work/windows.log" || fail "$(cat "$work/windows.log")"
}
depth='image:tests/media/box_depth.png?depth_unit=0.001&fx=600'
both densepose tests/media/photo.jpg --out OUT/people --overlay --threads 2
both head tests/media/photo.jpg --out OUT/head.glb --save OUT/head.maqh --threads 2
both edges "$depth" --out OUT/edges --boxes --format json --threads 2
both record 'stub:people?count=1&seed=7' OUT/gehö.maqrec --frames 12
both densepose OUT/gehö.maqrec --out OUT/clip --max-frames 2 --threads 2
both predict OUT/gehö.maqrec --from 8 --frames 4 --out OUT/next.mp4 --threads 2
both scene build tests/media/room --out OUT/room.maqs --threads 2
both scene render OUT/room.maqs --capture tests/media/room --views held-out --out OUT/views --threads 2

for result in people/photo_{IUV,INDS,overlay}.png people/photo.json head.glb edges/box_depth_{distance,kind}.png \
    edges/box_depth_edges.json gehö.maqrec clip/gehö_00000{0,1}_IUV.png next.mp4; do
    cmp "$work/linux/$result" "$work/windows/$result" || fail "$result differs"
done
cmp "$work"/{linux,windows}/room.maqs || fail "room.maqs differs"
diff -r "$work"/{linux,windows}/views || fail "views of the room differ"
python3 - "$work"/{linux,windows}/edges/box_depth_curves.json <<'PYTHON' || fail "the curves differ"
import json, sys

def compare(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(compare(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(compare, a, b))
    return abs(a - b) <= 1e-9 if isinstance(a, float) else a == b

sys.exit(not compare(*(json.load(open(path, encoding="utf-8")) for path in sys.argv[1:])))
PYTHON

# A program in C, by the public headers and the import library.
program="$stage/wait_for_frame.exe"
x86_64-w64-mingw32-gcc-posix -std=c99 -Wall -Wextra -Werror -Isdk/include tests/windows/wait_for_frame.c \
    build/windows-x86_64/archive/libmaquette.dll.a -o "$program"
frames="$("$wine" "$program" 2>/dev/null)" || fail "wait_for_frame: $frames"
rm "$program"

# This build says what it cannot do.
refused() {
    local said=$1
    shift
    windows "$@" >"$work/windows.log" 2>&1 && fail "maquette $* was not refused"
    grep -q "$said" "$work/windows.log" || fail "maquette $*: $(cat "$work/windows.log")"
}
refused 'the build for Windows reads none' densepose tests/media/clip.mp4 --out "$work/refused"
refused 'No camera was found' densepose camera: --out "$work/refused"
refused 'does not exist' densepose "$work/ähnlich.jpg" --out "$work/refused"
echo "The results under Wine are those of this system."
