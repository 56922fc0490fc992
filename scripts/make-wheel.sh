#!/usr/bin/env bash
# Builds the Python packages into build/wheel: maquette-*.whl for each machine, and the networks of each system.
#
#   scripts/make-wheel.sh [x86_64] [aarch64]      default: this machine's
set -euo pipefail
cd "$(dirname "$0")/.."
out=build/wheel
rm -rf "$out"
mkdir -p "$out"
for machine in "${@:-$(uname -m)}"; do
    scripts/wheel/prepare.sh "$machine" "${JOBS:-$(nproc)}"
    cmake --preset "wheel-$machine" >"$out/configure.log"
    cmake --build "build/wheel-$machine" -j "${JOBS:-$(nproc)}" >"$out/build.log" || { tail -40 "$out/build.log" >&2; exit 1; }
    cmake --install "build/wheel-$machine" --prefix "$PWD/$out/installed" >"$out/install.log"
    # A copy, since setuptools leaves its own files beside the sources.
    cp -r python "$out/source"
    MAQ_INSTALLED="$PWD/$out/installed" MAQ_CODECS="$PWD/.deps/codecs-$machine" MAQ_PLATFORM="manylinux_2_28_$machine" \
        MAQ_SAMPLES="$PWD/tests/media/photo.jpg $PWD/tests/media/box_depth.png" \
        .venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation \
        --wheel-dir "$out" "$out/source"
    .venv/bin/python scripts/wheel/model_wheels.py "$out/installed/share/maquette" "$out"
    rm -rf "$out/source" "$out/installed"
done
rm -f "$out"/*.log
ls -l "$out"/*.whl
