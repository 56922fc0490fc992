#!/usr/bin/env bash
# Runs the built SDK on the bundled photo and clip: scripts/demo.sh [OUTPUT_FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."
out="${1:-demo-output}"
maquette=build/release/stage/bin/maquette
if [ ! -x "$maquette" ]; then
    echo "The maquette program is not built. Run: make build" >&2
    exit 1
fi

mkdir -p "$out"
"$maquette" info
for source in image:tests/media/photo.jpg video:tests/media/clip.mp4; do
    printf '\n== maquette densepose %s --out %s --overlay\n' "$source" "$out"
    "$maquette" densepose "$source" --out "$out" --overlay
done

printf '\nPictures to look at, in %s:\n' "$out"
find "$out" -name '*_overlay.*' | sort | sed 's/^/  /'
printf 'Beside them: <stem>_IUV.png, <stem>_INDS.png and <stem>.json of every frame (docs/formats.md).\n'
