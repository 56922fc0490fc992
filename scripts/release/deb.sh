#!/usr/bin/env bash
# Builds the Debian packages into a folder:
#
#   scripts/release/deb.sh OUT
#
# libmaquette, libmaquette-dev, maquette and maquette-models come from a build of their own in build/deb, whose files
# have no RUNPATH and lie in /usr. With ccache, objects of build/release are not compiled again.
# MAQ_MAINTAINER: name and address in the packages.
set -euo pipefail
cd "$(dirname "$0")/../.."
case "${1:-}" in '' | -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
out=$(realpath "$1")
maintainer="${MAQ_MAINTAINER:-Maquette maintainers <maintainers@maquette.example>}"
version="$(sed -n 's/^project(maquette VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)"
export ROOT="$PWD" BUILD="$PWD/build/deb" SOVERSION="${version%.*}"
SOURCE_DATE_EPOCH="$(git log -1 --format=%ct)"
export SOURCE_DATE_EPOCH

cmake --preset release -B "$BUILD" --log-level=WARNING -DCMAKE_INSTALL_PREFIX=/usr -DCMAKE_SKIP_RPATH=ON \
    -DMAQ_BUILD_TESTS=OFF -DMAQ_BUILD_DESKTOP_DEMO=OFF >/dev/null
cmake --build "$BUILD" -j "${JOBS:-$(nproc)}" -- --quiet

source="$BUILD/packages/maquette-$version"
rm -rf "$BUILD/packages"
mkdir -p "$source"
cp -r scripts/release/debian "$source/debian"
sed -i "s/@SOVERSION@/$SOVERSION/; s/@MAINTAINER@/$maintainer/" "$source/debian/control"
{
    date="$(date -R -u -d "@$SOURCE_DATE_EPOCH")"
    printf 'maquette (%s) unstable; urgency=medium\n\n' "$version"
    printf '  * Release %s. CHANGELOG.md of the source lists the changes.\n\n -- %s  %s\n' "$version" "$maintainer" "$date"
} >"$source/debian/changelog"
for program in maquette maquette-bench; do
    help2man --no-info --no-discard-stderr --version-string "$version" --name "on-device vision" \
        "build/release/stage/bin/$program" --output "$source/debian/$program.1"
    echo "debian/$program.1" >>"$source/debian/maquette.manpages"
done
mkdir "$source/debian/source"
echo "3.0 (native)" >"$source/debian/source/format"
(cd "$source" && dpkg-buildpackage --build=binary --no-sign --no-check-builddeps) >"$BUILD/packages/log" 2>&1 ||
    { tail -n 40 "$BUILD/packages/log" >&2; exit 1; }
cp "$BUILD"/packages/*.deb "$out"
