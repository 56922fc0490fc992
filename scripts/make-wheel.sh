#!/usr/bin/env bash
# Builds the Python package from build/release into build/wheel/maquette-*.whl; `make wheel` builds that first.
set -euo pipefail
cd "$(dirname "$0")/.."
out=build/wheel
rm -rf "$out"
mkdir -p "$out"
cmake --install build/release --prefix "$PWD/$out/installed" >"$out/install.log"
# A copy, since setuptools leaves its own files beside the sources.
cp -r python "$out/source"
MAQ_INSTALLED="$PWD/$out/installed" .venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps \
    --no-build-isolation --wheel-dir "$out" "$out/source"
rm -rf "$out/source" "$out/installed"
ls -l "$out"/*.whl
