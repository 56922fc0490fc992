#!/usr/bin/env bash
# Makes .venv with the pinned Python packages of pyproject.toml; does nothing when it is up to date.
#
#   scripts/make-venv.sh            the light set: evaluation, pictures, reports
#   scripts/make-venv.sh dev        + pytest and ruff
#   scripts/make-venv.sh train,dev  + torch and moderngl (about 6 GB on disk); `teachers`: + LiteRT, `captures`: + COLMAP,
#                                   `cluster`: + Dask, `solids`: + OpenCascade and Embree, `heads`: + libigl and Embree,
#                                   `clips`: + PyBullet
#
# PYTHON chooses the interpreter (default python3, 3.11 or newer).
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in -h | --help) sed -n '2,10s/^# \{0,1\}//p' "$0"; exit 0 ;; esac

extras="${1:-}"
python="${PYTHON:-python3}"
stamp=".venv/.ready-${extras:-light}"
exec 9<"$0"  # one at a time, in one environment
flock 9
if [ -f "$stamp" ] && [ ! pyproject.toml -nt "$stamp" ]; then exit 0; fi

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "Python 3.11 or newer is needed, $python is $("$python" -V 2>&1). Set PYTHON to another interpreter." >&2
    exit 1
}
[ -x .venv/bin/python ] || "$python" -m venv .venv
echo "Installing Python packages into .venv${extras:+ (with $extras)}"
.venv/bin/python -m pip install --quiet --disable-pip-version-check -e ".${extras:+[$extras]}"
touch "$stamp"
