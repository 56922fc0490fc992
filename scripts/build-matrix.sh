#!/bin/bash
# Builds the library with several choices of systems, each in its own folder; runs the tests of the systems that are in,
# installs, compiles a program against the installed copy, and prints a table of the sizes of libmaquette.so.
#
#   scripts/build-matrix.sh [--no-tests] [--sizes FILE] [NAME...]
#
# NAME: none, densepose, scenes, edges, heads, prediction, densepose+edges, all (default: each of them).
# --sizes FILE: writes the sizes as JSON, for the benchmark report.
set -euo pipefail
cd "$(dirname "$0")/.."
systems="DENSEPOSE SCENES EDGES HEADS PREDICTION BODY"
tests=ON
sizes=
names=()
while [ $# -gt 0 ]; do
  case "$1" in
    --no-tests) tests=OFF ;;
    --sizes) sizes="$2"; shift ;;
    -*) sed -n '2,9p' "$0" | cut -c3-; exit 2 ;;
    *) names+=("$1") ;;
  esac
  shift
done
[ ${#names[@]} -gt 0 ] || names=(none densepose scenes edges heads prediction densepose+edges all)

jobs="${MAQ_JOBS:-$(nproc)}"
root="build/matrix"
mkdir -p "$root"
table=()
json=
for name in "${names[@]}"; do
  folder="$root/$name"
  options=()
  for system in $systems; do
    case "+${name^^}+" in
      *+ALL+* | *"+$system+"*) options+=("-DMAQ_WITH_$system=ON") ;;
      *) options+=("-DMAQ_WITH_$system=OFF") ;;
    esac
  done
  echo "== $name"
  cmake -G Ninja -S . -B "$folder" -DCMAKE_BUILD_TYPE=Release -DMAQ_WARNINGS_AS_ERRORS=ON -DMAQ_BUILD_TESTS=$tests \
    -DMAQ_BUILD_DESKTOP_DEMO=OFF "${options[@]}" >"$folder.configure.log" 2>&1 || { cat "$folder.configure.log"; exit 1; }
  cmake --build "$folder" -j "$jobs" >"$folder.build.log" 2>&1 || { tail -40 "$folder.build.log"; exit 1; }
  if [ $tests = ON ]; then
    label="$(echo "$name" | tr '+' '|')"
    case "$name" in
      none) filter=(-R '^native[.](Sources|Recordings|Uri|Bundle|Resize|ApiFrames|ApiSources|ApiClips|header[.].*|exports)$') ;;
      all) filter=(-L native) ;;
      *) filter=(-L "^($label)$") ;;
    esac
    ctest --test-dir "$folder" "${filter[@]}" --output-on-failure >"$folder.test.log" 2>&1 \
      || { tail -60 "$folder.test.log"; exit 1; }
    grep 'tests passed' "$folder.test.log"
  fi
  rm -rf "$folder/prefix"
  cmake --install "$folder" --prefix "$folder/prefix" >"$folder.install.log"
  "$folder/prefix/bin/maquette" info | grep '^Systems'
  # Every header that is installed compiles alone, and a program links.
  for header in "$folder"/prefix/include/maquette/*.h; do
    cc -std=c99 -Wall -Wextra -pedantic -Werror -fsyntax-only "-I$folder/prefix/include" -x c "$header"
  done
  for header in "$folder"/prefix/include/maquette/*.hpp; do
    c++ -std=c++17 -Wall -Wextra -pedantic -Werror -fsyntax-only "-I$folder/prefix/include" -x c++ "$header"
  done
  library="$(find "$folder/prefix" -name 'libmaquette.so.*.*.*')"
  echo '#include <maquette/maquette.h>
    int main(void) { maq_context* context = 0; return maq_context_create(MAQ_HEADER_VERSION, 0, &context); }' \
    | cc -std=c99 "-I$folder/prefix/include" -x c - -x none "$library" -o "$folder/prefix/program" \
      "-Wl,-rpath,$(dirname "$(realpath "$library")")"
  "$folder/prefix/program"
  bytes=$(stat -c %s "$library")
  models=$(du -bs "$folder/prefix/share/maquette/models" | cut -f1)
  table+=("$(printf '| %-16s | %9d | %9d |' "$name" "$bytes" "$models")")
  json+="${json:+, }\"$name\": {\"library_bytes\": $bytes, \"models_bytes\": $models}"
done
printf '\n| systems          | library   | models    |\n| ---------------- | --------- | --------- |\n'
printf '%s\n' "${table[@]}"
[ -z "$sizes" ] || echo "{$json}" >"$sizes"
