#!/usr/bin/env bash
# Runs the built SDK on the bundled photo (people, a head of one), clip, depth picture and room, and on a real place:
# scripts/demo.sh [OUTPUT_FOLDER]
#
# The capture of a real object (box, or the captures in .data/places/real) and photos of a house are fetched once. That
# needs Python 3.11, a network and some minutes. Without a network the demo says so and goes on; REAL=no leaves the capture out.
set -euo pipefail
cd "$(dirname "$0")/.."
[ -t 2 ] || export TQDM_DISABLE=1  # progress bars are for terminals
out="${1:-demo-output}"
maquette=build/release/stage/bin/maquette
places=.data/places/real
if [ ! -x "$maquette" ]; then
    echo "The maquette program is not built. Run: make build" >&2
    exit 1
fi

mkdir -p "$out"
"$maquette" info
for source in image:tests/media/photo.jpg video:tests/media/clip.mp4; do
    printf '\n== maquette densepose %s --out %s --overlay --keypoints\n' "$source" "$out"
    "$maquette" densepose "$source" --out "$out" --overlay --keypoints
done

# A body of the person in the clip, moving: glTF for viewers, BVH for animation programs.
printf '\n== maquette body tests/media/clip.mp4 --out %s/body.glb --bvh %s/body.bvh\n' "$out" "$out"
"$maquette" body tests/media/clip.mp4 --out "$out/body.glb" --bvh "$out/body.bvh"

# An animatable head of the person with the photo as its texture, and a clip of it turning.
printf '\n== maquette head tests/media/photo.jpg --out %s/head.glb --preview %s/head_turning.mp4\n' "$out" "$out"
"$maquette" head tests/media/photo.jpg --out "$out/head.glb" --preview "$out/head_turning.mp4"

# Predicts the next frames of the clip, next to the real ones, and puts an event of each kind into it, which camera health names.
printf '\n== maquette predict tests/media/clip.mp4 --from 15 --frames 30 --compare --out %s/next.mp4\n' "$out"
"$maquette" predict tests/media/clip.mp4 --from 15 --frames 30 --compare --out "$out/next.mp4"
printf '\n== maquette health tests/media/clip.mp4 --out %s/health.mp4\n' "$out"
"$maquette" health tests/media/clip.mp4 --out "$out/health.mp4"
if .venv/bin/python -c 'import cv2, cffi' 2>/dev/null; then
    printf '\n== python -m benchmarks.camera_health.strip tests/media/clip.mp4 --out %s/health_events.png\n' "$out"
    PYTHONPATH=.:python .venv/bin/python -m benchmarks.camera_health.strip tests/media/clip.mp4 \
        --other tests/media/photo.jpg --out "$out/health_events.png"
fi

# The edges of a carton that a depth camera sees, and its size beside the true one.
depth='image:tests/media/box_depth.png?depth_unit=0.001&fx=600'
printf "\n== maquette edges '%s' --out %s --overlay --boxes --format json,step,dxf\n" "$depth" "$out"
"$maquette" edges "$depth" --out "$out" --overlay --boxes --format json,step,dxf
echo "  in truth    441 x 427 x 411 mm (tests/media/box_depth.json)"

# Fetches a capture of a real object, unless one is there. Returns 1 when there is none to show: with REAL=no, and
# without a network. Any other failure ends the demo with an error.
fetch_real() {
    local status=0
    [ "${REAL:-yes}" != no ] || { echo "REAL=no: no capture of a real object"; return 1; }
    compgen -G "$places/*/transforms.json" >/dev/null && return 0
    printf '\n== python -m export.captures fetch box\n'
    { scripts/make-venv.sh captures && .venv/bin/python -m export.captures fetch box; } || status=$?
    [ $status -ne 0 ] || return 0
    if [ $status -ne 69 ]; then
        echo "The capture of a real object could not be made (exit status $status). REAL=no leaves it out." >&2
        exit $status
    fi
    echo "There is no network, so only the rendered room is shown. With a network, run make demo again."
    return 1
}

# fly FOLDER: makes a scene of a capture and a clip of a flight along its cameras.
fly() {
    local scene
    scene="$out/$(basename "$1")"
    printf '\n== maquette scene build %s --out %s.maqs\n' "$1" "$scene"
    "$maquette" scene build "$1" --out "$scene.maqs"
    printf '\n== maquette scene render %s.maqs --capture %s --path through --seconds 6 --size 640x480 --out %s.mp4\n' \
        "$scene" "$1" "$scene"
    "$maquette" scene render "$scene.maqs" --capture "$1" --path through --seconds 6 --size 640x480 --out "$scene.mp4"
}

# make_place NAME: fetches plain photos of a real place; makes a scene of them in one command, and a flight along its cameras.
make_place() {
    local photos=.data/places/photos/$1 python
    python=(env PYTHONPATH=.:python .venv/bin/python)
    scripts/make-venv.sh captures && { [ -d "$photos" ] || "${python[@]}" -m export.captures photos "$1"; } || return 0
    printf '\n== maquette scene make %s --out %s.maqs\n' "$photos" "$out/$1"
    "${python[@]}" -m maquette scene make "$photos" --out "$out/$1.maqs"
    printf '\n== maquette scene render %s.maqs --capture %s-work/capture --path through --seconds 6 --size 640x480 --out %s.mp4\n' \
        "$out/$1" "$out/$1" "$out/$1"
    "$maquette" scene render "$out/$1.maqs" --capture "$out/$1-work/capture" --path through --seconds 6 --size 640x480 \
        --out "$out/$1.mp4"
}

# first_depth FOLDER: the first depth image of a capture as a source.
first_depth() {
    python3 - "$1" <<'PYTHON'
import json, sys
capture = json.load(open(sys.argv[1] + "/transforms.json"))
frame = next((f for f in capture["frames"] if "depth_file_path" in f), None)
if frame:
    lens = "&".join(f"{to}={frame[of] - less:.3f}" for to, of, less in
                    (("fx", "fl_x", 0), ("fy", "fl_y", 0), ("cx", "cx", 0.5), ("cy", "cy", 0.5)))
    unit = capture.get("depth_unit_scale_factor", 0.001)
    print(f"image:{sys.argv[1]}/{frame['depth_file_path']}?depth_unit={unit:.9f}&{lens}")
PYTHON
}

# edges FOLDER: the edges of a real thing, in the depth of one photo, and of all photos as one.
edges() {
    local name source
    name="$(basename "$1")" source="$(first_depth "$1")"
    [ -n "$source" ] || return 0
    printf "\n== maquette edges '%s' --out %s --overlay --boxes --format step\n" "$source" "$out/${name}_edges"
    "$maquette" edges "$source" --out "$out/${name}_edges" --overlay --boxes --format step
    printf '\n== maquette edges build %s --out %s_edges/all.dxf\n' "$1" "$out/$name"
    "$maquette" edges build "$1" --out "$out/${name}_edges/all.dxf"
    echo "  lengths in units of the capture: photos alone do not tell metres"
}

fly tests/media/room
if fetch_real; then
    for transforms in "$places"/*/transforms.json; do
        fly "$(dirname "$transforms")"
        edges "$(dirname "$transforms")"
    done
    make_place house
fi

printf '\nPictures to look at, in %s:\n' "$out"
find "$out" -name '*_overlay.*' -o -name '*.mp4' -o -name 'health_events.png' | sort | sed 's/^/  /'
printf 'Beside them: <stem>_IUV.png, <stem>_INDS.png and <stem>.json of every frame (docs/reference/formats.md); <place>.maqs, scenes;\n'
printf 'box_depth_distance.png and box_depth_kind.png, the field of edges; box_depth_curves.step, .dxf and .json, its curves; head.glb.\n'
