#!/usr/bin/env bash
# Collects a release in build/dist and prints the command that tags it; `make release` builds its parts first:
#
#   scripts/release/build.sh
#
#   *.whl                        Python packages                        (build/wheel)
#   maquette-VERSION-*.tar.gz    library, headers, programs, networks, examples  (build/wheel-MACHINE)
#   maquette-models-*.tar.gz     the networks of each system
#   *.deb                        Debian packages                        (deb.sh)
#   maven/                       Maven repository with the AAR          (build/android)
#   SHA256SUMS, SHA256SUMS.minisig
#
# Each package contains its SBOM. MAQ_MINISIGN_KEY: the secret key that signs; default: the test key of this
# repository, which proves nothing. docs/reference/packages.md tells how to check a release.
set -euo pipefail
cd "$(dirname "$0")/../.."
case "${1:-}" in '') ;; *) sed -n '2,16s/^# \{0,1\}//p' "$0"; exit 0 ;; esac
key="$(realpath "${MAQ_MINISIGN_KEY:-tests/release/TEST-ONLY.key}")"
version="$(sed -n 's/^project(maquette VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)"
epoch="$(git log -1 --format=%ct)"
dist="$PWD/build/dist"
work="$PWD/build/dist-work"
commit="$(git rev-parse --short=12 HEAD)"
for build in build/release "build/wheel-$(uname -m)"; do
    built="$("$build/stage/bin/maquette" info | sed -n 's/.*(commit \(.*\))/\1/p')"
    [ "$built" = "$commit" ] || {
        echo "$build is of commit $built ('+': with changes), but HEAD is $commit. Commit changes, run cmake -B $build" \
            "and make release again." >&2
        exit 1
    }
done
rm -rf "$dist" "$work"
mkdir -p "$dist" "$work"
python="${PYTHON:-python3}"

# pack NAME MACHINE COMPONENT...: a tarball of installed components with their SBOM; the same content gives the same bytes.
pack() {
    local name=$1 machine=$2 component
    mkdir -p "$work/$name/share/maquette/licenses"
    for component in "${@:3}"; do
        cmake --install "build/wheel-$machine" --prefix "$work/$name" --component "$component" >/dev/null
        # The library contains codecs and the C++ runtime.
        [ "$component" != runtime ] || cp ".deps/codecs-$machine/licenses"/*.txt "$work/$name/share/maquette/licenses/"
        [ "$component" != runtime ] || cp /usr/share/doc/libstdc++6/copyright "$work/$name/share/maquette/licenses/libstdc++.txt"
    done
    cp LICENSE "$work/$name/share/maquette/licenses/"
    case " ${*:3} " in *" development "*) git archive HEAD README.md examples | tar -x -C "$work/$name" ;; esac
    "$python" scripts/release/sbom.py --name "${name%-"$version"*}" --root "$work/$name" \
        --out "$work/$name/share/maquette/sbom/${name%-"$version"*}.cdx.json"
    tar --create --directory "$work" --sort=name --mtime="@$epoch" --owner=0 --group=0 --numeric-owner \
        --mode=u+w,go=rX "$name" | gzip -n -9 >"$dist/$name.tar.gz"
}
systems=(densepose scenes edges heads prediction body)
for build in build/wheel-*/; do
    machine="$(basename "${build#build/wheel-}")"
    pack "maquette-$version-linux-$machine" "$machine" runtime development tools "${systems[@]/#/models-}"
done
for system in "${systems[@]}"; do pack "maquette-models-$system-$version" "$(uname -m)" "models-$system"; done

scripts/release/deb.sh "$dist"

for wheel in build/wheel/*.whl; do
    cp "$wheel" "$dist/"
    "$python" scripts/release/sbom.py --wheel "$dist/${wheel##*/}"
done

cp -r build/android/repository "$dist/maven"

cd "$dist"
find . -type f -printf '%P\n' | LC_ALL=C sort | xargs -d '\n' sha256sum >"$work/SHA256SUMS"
mv "$work/SHA256SUMS" .
minisign -S -s "$key" -m SHA256SUMS -t "Maquette $version, commit $commit"
du -ah --apparent-size "$dist" | grep -E '\.(whl|gz|deb|aar|minisig)$|SUMS$'
echo
[[ "$key" != */TEST-ONLY.key ]] || echo "Signed with the test key: this is not a release. Set MAQ_MINISIGN_KEY."
echo "Check it: make test-release"
echo "Tag it:   git tag -a v$version -m 'Maquette $version' $commit"
