#!/usr/bin/env bash
# Heads as .glb, animatable with and without a texture and as the dense surface, and bodies of a clip, by the Khronos
# validator (npm, Apache-2.0). Where Chromium is there, three.js (npm, MIT) shows the head's actions and joints, and the
# bodies in motion, and compares the joints of a .glb and a .bvh file. Needs node, npm and the built program.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v npm >/dev/null || { echo "npm is missing: install Node.js to check .glb files." >&2; exit 1; }
made=build/glb
mkdir -p "$made"
npm install --silent --no-audit --no-fund --prefix "$made" gltf-validator@2.0.0-dev.3.10 three@0.170.0
head() {
  build/release/stage/bin/maquette head tests/media/photo.jpg --seconds 0 --out "$made/$1.glb" "${@:2}" >/dev/null
}
head head
head colours --no-texture
head dense --triangles 60000
body() {
  build/release/stage/bin/maquette body "stub:people?count=$1&seed=3" --max-frames 30 --out "$made/$2.glb" \
      --bvh "$made/$2.bvh" >/dev/null
}
body 1 person
body 3 people
node scripts/validate_glb.js "$made" "$made"/*.glb tests/native/data/head_mesh/*.glb
if command -v chromium >/dev/null; then
  python3 scripts/glb_viewer/show.py "$made" "$made/head.glb" --head --picture "$made/head.png"
  for seconds in 0 0.4 0.8; do
    python3 scripts/glb_viewer/show.py "$made" "$made/person.glb" --bvh "$made/person.bvh" --seconds $seconds
  done
  python3 scripts/glb_viewer/show.py "$made" "$made/people.glb" --seconds 0.4 --picture "$made/people.png"
else
  echo "chromium is missing: heads and bodies are not shown in three.js."
fi
