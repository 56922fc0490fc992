#!/usr/bin/env bash
# Makes the folders that cmake/wheel.cmake needs: static codecs, and libraries of an old glibc to link against.
#
#   scripts/wheel/prepare.sh x86_64 | aarch64 [JOBS]
set -euo pipefail
cd "$(dirname "$0")/../.."
machine="${1:-x86_64}"
prefix=
if [ "$machine" != "$(uname -m)" ]; then
    prefix="$machine-linux-gnu-"
    scripts/aarch64-sysroot.sh
fi
scripts/static-codecs.sh "$machine" "${2:-$(nproc)}"
python3 scripts/wheel/old_glibc.py ".deps/glibc-2.28-$machine" --prefix "$prefix"
