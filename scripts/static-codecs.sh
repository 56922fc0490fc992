#!/usr/bin/env bash
# Builds the codecs that become part of libmaquette.so in wheels: libjpeg-turbo, libpng, libwebp, libvpx and zlib, from the
# sources of this Debian, into .deps/codecs-MACHINE (include/, lib/, licenses/).
#
#   scripts/static-codecs.sh [x86_64 | aarch64 | windows-x86_64] [JOBS]
#
# Debian's own static libraries cannot be a part of a shared library. apt works in a folder of its own and checks sources
# by Debian's signatures. Changes nothing of the system; remove the folder to build anew. 15 MB, one to three minutes.
set -euo pipefail
cd "$(dirname "$0")/.."
machine="${1:-x86_64}"
jobs="${2:-$(nproc)}"
case "$machine" in
    x86_64) prefix= vpx_target=x86_64-linux-gcc ;;
    aarch64) prefix=aarch64-linux-gnu- vpx_target=arm64-linux-gcc ;;
    windows-x86_64) prefix=x86_64-w64-mingw32- vpx_target=x86_64-win64-gcc ;;
    *) sed -n '2,9s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac
[ "$(uname -m)" != "$machine" ] || prefix=
codecs="$PWD/.deps/codecs-$machine"
stamp="$codecs/.ready"
made_by="$(sha256sum <"$0")"
[ "$(cat "$stamp" 2>/dev/null || true)" = "$made_by" ] && exit 0

work="$codecs.work"
rm -rf "$codecs" "$work"
mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$codecs/licenses"
mirror="$(apt-get indextargets --format '$(REPO_URI) $(RELEASE)' 'Created-By: Packages' | sed -n 's/ bookworm$//p' | head -1)"
[ -n "$mirror" ] || { echo "apt has no server of Debian's bookworm here: the sources of codecs are Debian 12's." >&2; exit 1; }
echo "deb-src $mirror bookworm main" >"$work/sources.list"
apt=(apt-get -qq -o Dir::Etc::sourcelist="$work/sources.list" -o Dir::Etc::sourceparts=-
    -o Dir::State::lists="$work/lists" -o Dir::Cache="$work/cache" -o APT::Sandbox::User= -o Debug::NoLocking=true)
echo "Building static codecs for $machine (sources of 15 MB, once)"
"${apt[@]}" update
(cd "$work" && "${apt[@]}" source libjpeg-turbo libpng1.6 libwebp libvpx zlib >/dev/null 2>"$work/source.log") ||
    { cat "$work/source.log" >&2; exit 1; }

# Nothing is searched beyond the codecs: flags are the same on all machines.
gcc="${prefix}gcc" gxx="${prefix}g++"
[ "$machine" != windows-x86_64 ] || gcc+=-posix gxx+=-posix  # threads of C++ need this variant
export CC="$gcc" CXX="$gxx" AR="${prefix}ar" RANLIB="${prefix}ranlib" CFLAGS="-O2 -fPIC -fvisibility=hidden \
-fstack-protector-strong -D_FORTIFY_SOURCE=2 -ffunction-sections -fdata-sections -ffp-contract=off -ffile-prefix-map=$work=."
host=()
[ -z "$prefix" ] || host=(--host="${prefix%-}")
run() { "$@" >>"$work/build.log" 2>&1 || { tail -40 "$work/build.log" >&2; exit 1; }; }
each() { echo "$work/$1"-[0-9]*/; }

cd $(each zlib)
chost="${prefix%-}"
[ "$machine" != windows-x86_64 ] || chost=  # for which this script of zlib refuses to work; $CC is enough
CHOST="$chost" run ./configure --static --prefix="$codecs"
run make -j"$jobs" libz.a
cp libz.a "$codecs/" && mkdir -p "$codecs/include" "$codecs/lib" && mv "$codecs/libz.a" "$codecs/lib/"
cp zlib.h zconf.h "$codecs/include/"

cd $(each libjpeg-turbo)
system=(-DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR="$machine")
[ "$machine" != windows-x86_64 ] ||
    system=(-DCMAKE_SYSTEM_NAME=Windows -DCMAKE_SYSTEM_PROCESSOR=x86_64 -DCMAKE_INSTALL_PREFIX="$codecs"
        -DCMAKE_RC_COMPILER="${prefix}windres")
run cmake -B build -G Ninja -DCMAKE_BUILD_TYPE=None -DENABLE_SHARED=OFF -DWITH_JAVA=OFF -DREQUIRE_SIMD=ON \
    $([ -z "$prefix" ] || echo "${system[@]}")
run ninja -C build -j"$jobs" turbojpeg-static
cp build/libturbojpeg.a "$codecs/lib/"
cp turbojpeg.h "$codecs/include/"

cd $(each libpng1.6)
run ./configure "${host[@]}" --disable-shared CPPFLAGS="-I$codecs/include" LDFLAGS="-L$codecs/lib"
run make -j"$jobs" libpng16.la
cp .libs/libpng16.a "$codecs/lib/libpng.a"
cp png.h pngconf.h pnglibconf.h "$codecs/include/"

cd $(each libwebp)
[ -x configure ] || run autoreconf -fi
run ./configure "${host[@]}" --disable-shared --disable-libwebpmux --disable-libwebpdemux --disable-png --disable-jpeg \
    --disable-tiff --disable-gif --disable-gl --disable-sdl --disable-threading --enable-libwebpdecoder
for part in dec dsp utils; do run make -j"$jobs" -C src/$part; done
run make -C src libwebpdecoder.la
cp src/.libs/libwebpdecoder.a "$codecs/lib/libwebp.a"
mkdir -p "$codecs/include/webp" && cp src/webp/{decode,types}.h "$codecs/include/webp/"

mkdir -p "$work/vpx" && cd "$work/vpx"
CROSS="$prefix" STRIP="${prefix}strip" NM="${prefix}nm" run $(each libvpx)configure \
    --target=$vpx_target --enable-pic --disable-vp8 --disable-vp9-decoder --disable-examples --disable-tools --disable-docs \
    --disable-unit-tests --disable-install-bins --enable-runtime-cpu-detect --disable-webm-io --disable-libyuv --enable-realtime-only --disable-postproc \
    --prefix="$codecs"
run make -j"$jobs" libvpx.a
cp libvpx.a "$codecs/lib/"
mkdir -p "$codecs/include/vpx" && cp $(each libvpx)vpx/*.h "$codecs/include/vpx/"

for source in libjpeg-turbo libpng1.6 libwebp libvpx zlib; do
    cp $(each $source)debian/copyright "$codecs/licenses/$source.txt"
done
cd "$codecs/.."
rm -rf "$work"
printf '%s\n' "$made_by" >"$stamp"
