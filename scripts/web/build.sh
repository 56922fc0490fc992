#!/usr/bin/env bash
# Builds the npm package into build/web/package, and the page into build/web/page:
#
#   scripts/web/build.sh [JOBS]
#
# Exit status 77: it cannot be built here, and the last line says why.
set -euo pipefail
cd "$(dirname "$0")/../.."
jobs=${1:-$(nproc)}
if ! command -v emcc >/dev/null; then
    echo "emscripten is missing: scripts/install-packages.sh web"
    exit 77
fi
# Debian's emscripten finds its JavaScript tools here, whichever node is in use.
export NODE_PATH=/usr/share/nodejs${NODE_PATH:+:$NODE_PATH}

headers=.deps/web-headers
if [ ! -e "$headers/.ready" ]; then
    rm -rf "$headers"
    mkdir -p "$headers"
    dpkg-query -L nlohmann-json3-dev | grep /include/ | while read -r file; do
        [ ! -f "$file" ] || { mkdir -p "$headers/$(dirname "${file#*/include/}")"; cp "$file" "$headers/${file#*/include/}"; }
    done
    touch "$headers/.ready"
fi

commit=$(git rev-parse --short=12 HEAD 2>/dev/null || echo unknown)
emcmake cmake -S web -B build/web/core -DMAQ_PORTABLE_HEADERS="$PWD/$headers" -DMAQ_COMMIT="$commit" >/dev/null
cmake --build build/web/core -j "$jobs"

node web/tools/assemble.js build/web/package
(cd build/web && rm -f maquette-*.tgz && npm pack --silent ./package >/dev/null)

(cd web/demo && npm install --silent --no-audit --no-fund && npx vite build --logLevel warn)
echo "The package is build/web/$(cd build/web && ls maquette-*.tgz), the page build/web/page/index.html."
