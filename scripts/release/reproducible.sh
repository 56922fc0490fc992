#!/usr/bin/env bash
# Builds the library twice, in folders whose names differ in length, and compares all installed files:
#
#   scripts/release/reproducible.sh
#
# The commit at HEAD is built: in build/reproducible/one, and, without a compiler cache, in
# build/reproducible/another-folder. Takes 6.5 minutes of processor time.
set -euo pipefail
cd "$(dirname "$0")/../.."
case "${1:-}" in '') ;; *) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

work="$PWD/build/reproducible"
rm -rf "$work"
# build FOLDER [ENVIRONMENT...]: clones HEAD into the folder, builds it, installs it beside it.
build() {
    local folder="$work/$1"
    git clone --quiet "$PWD" "$folder"
    [ ! -e .deps ] || ln -s "$(realpath .deps)" "$folder/.deps"
    (cd "$folder" && env "${@:2}" scripts/build.sh release -DMAQ_BUILD_TESTS=OFF -DMAQ_BUILD_DESKTOP_DEMO=OFF)
    cmake --install "$folder/build/release" --prefix "$folder-installed" >/dev/null
    (cd "$folder-installed" && find . -type f -print0 | sort -z | xargs -0 sha256sum) >"$folder.sums"
}
build one
build another-folder CCACHE_DISABLE=1
diff "$work/one.sums" "$work/another-folder.sums" || { echo "The two builds differ." >&2; exit 1; }
grep 'libmaquette\.so' "$work/one.sums"
echo "$(wc -l <"$work/one.sums") files of two builds are equal."
