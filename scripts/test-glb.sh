#!/usr/bin/env bash
# Heads as .glb, with colours, with a texture and in the template's topology, by the Khronos validator (npm,
# Apache-2.0). Needs node, npm and the built program.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v npm >/dev/null || { echo "npm is missing: install Node.js to check .glb files." >&2; exit 1; }
made=build/glb
mkdir -p "$made"
npm install --silent --no-audit --no-fund --prefix "$made" gltf-validator@2.0.0-dev.3.10
head() {
  build/release/stage/bin/maquette head tests/media/photo.jpg --seconds 0 --out "$made/$1.glb" "${@:2}" >/dev/null
}
head colours
head texture --texture 1024
head template --topology template
node scripts/validate_glb.js "$made" "$made"/*.glb tests/native/data/head_mesh/*.glb
