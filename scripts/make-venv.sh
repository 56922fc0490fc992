#!/usr/bin/env bash
# Creates .venv with the pinned Python packages of pyproject.toml. Does nothing when .venv is complete and up to date.
#
#   scripts/make-venv.sh            the light set: evaluation, images, reports
#   scripts/make-venv.sh dev        + pytest and ruff
#   scripts/make-venv.sh train,dev  + torch and moderngl (about 6 GB on disk); `teachers`: + LiteRT, `captures`: + COLMAP,
#                                   `cluster`: + Dask, `solids`: + OpenCascade and Embree, `heads`: + libigl and Embree,
#                                   `clips`: + PyBullet, `adapters`: + supervision and rerun
#
# PYTHON chooses the interpreter (default python3, 3.11 or newer).
# Exit status: 0 complete; 69 the package index cannot be reached; 1 anything else.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in -h | --help) sed -n '2,11s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

extras="${1:-}"
python="${PYTHON:-python3}"
stamp=".venv/.ready-${extras:-light}"
exec 9<"$0"  # one process at a time changes the environment
flock 9

has_pip() { .venv/bin/python -c 'import pip' 2>/dev/null; }
if [ -f "$stamp" ] && [ ! pyproject.toml -nt "$stamp" ] && has_pip; then exit 0; fi

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "Python 3.11 or newer is needed, $python is $("$python" -V 2>&1). Set PYTHON to another interpreter." >&2
    exit 1
}
# A run that was interrupted, or that had no pip, leaves no .venv: the environment is made beside it and then moved.
if ! has_pip; then
    rm -rf .venv .venv.new
    "$python" -m venv .venv.new || {
        rm -rf .venv.new
        echo "$python cannot create an environment. On Debian, install the package python3-venv." >&2
        exit 1
    }
    find .venv.new/bin -type f -exec sed -i "s|$PWD/.venv.new|$PWD/.venv|g" {} +
    mv .venv.new .venv
fi

echo "Installing Python packages into .venv${extras:+ (with $extras)}"
said=$(mktemp)
trap 'rm -f "$said"' EXIT
unreachable='NewConnectionError|ConnectTimeout|ReadTimeout|name resolution|Network is unreachable|Cannot connect to proxy'
# uv takes 2 seconds of processor time where pip takes 130. pip follows where uv fails, such as with a mirror that only
# pip's settings name, and its errors are shown.
pip=(.venv/bin/python -m pip install --quiet --disable-pip-version-check)
packages=(-e ".${extras:+[$extras]}")
if ! { "${pip[@]}" uv==0.13.9 && .venv/bin/python -m uv pip install --quiet --python .venv/bin/python "${packages[@]}"; } \
    2>/dev/null && ! "${pip[@]}" "${packages[@]}" 2>"$said"; then
    cat "$said" >&2
    grep -qE "$unreachable" "$said" || exit 1
    echo "The Python package index cannot be reached." >&2
    exit 69
fi
cat "$said" >&2
touch "$stamp"
