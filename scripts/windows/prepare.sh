#!/usr/bin/env bash
# Makes the folders that cmake/windows.cmake needs: static codecs, and headers that are the same on all systems.
#
#   scripts/windows/prepare.sh [JOBS]
set -euo pipefail
cd "$(dirname "$0")/../.."
scripts/static-codecs.sh windows-x86_64 "${1:-$(nproc)}"
headers=.deps/windows-headers
rm -rf "$headers"
mkdir -p "$headers"
for package in nlohmann-json3-dev libcli11-dev libxxhash-dev; do
    dpkg-query -L "$package" | grep -E '/(cmake|include)/' | while read -r file; do
        [ ! -f "$file" ] || cp --parents "$file" "$headers"
    done
done
touch "$headers/.ready"
