#!/bin/sh
# Trains dense pose on a machine with a GPU and without a network, from one file (python -m export.teachers.pack make),
# in three commands of at most ten minutes each, which leave everything below $WORK:
#
#     scripts/train-from-pack.sh render people.pack    unpacks; renders with all processors
#     scripts/train-from-pack.sh crops                 trains on person crops alone
#     scripts/train-from-pack.sh both OUT              on whole pictures and crops; copies weights, log and curves to OUT
#
# Environment: WORK (/dev/shm/maquette-training), PERCENT of the whole length (100), IMAGES (20000), PROCESSES to render
# with (all), BATCH and CROPS a step (32, 128), CROP_SIZE (192), PYTHON (python3, with torch, OpenCV, moderngl).
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
work=${WORK:-/dev/shm/maquette-training} percent=${PERCENT:-100} python=${PYTHON:-python3}
batch=${BATCH:-32} crops=${CROPS:-128} size=${CROP_SIZE:-192}
export PYTHONPATH="$root${PYTHONPATH:+:$PYTHONPATH}" OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"

part() { awk "BEGIN { print $1 * $percent / 100 }"; }

train() { # RECIPE WEIGHTS MINUTES MORE...
  recipe=$1 init=$2 minutes=$3
  shift 3
  "$python" -m export.densepose.train --recipe "$recipe" --data .data/people-wide --photos .data/photos/shards/train \
    --init "$init" --out ".data/runs/$recipe" --minutes "$(part "$minutes")" --batch "$batch" --crops "$crops" \
    --crop-size "$size" --backbone-rate 0.3 --ema 0.999 --validate-minutes 100 --save-minutes 2 "$@"
}

render() { # SPLIT IMAGES SECONDS; what was not rendered by then is left out
  timeout "$3" "$python" -m export.people.dataset --variety wide --out .data/people-wide --processes "$processes" \
    --split "$1" --images "$2" --per-shard 20 || [ $? = 124 ]
}

case ${1:-} in
render)
  [ $# = 2 ] || { echo "usage: train-from-pack.sh render PACK" >&2; exit 2; }
  pack=$(realpath "$2") processes=${PROCESSES:-$(nproc)}
  mkdir -p "$work" && cd "$work"
  "$python" -m export.teachers.pack open "$pack" --composed "$(part 1500 | cut -d. -f1)"
  render val "$(part 200 | cut -d. -f1)" 120
  render train "$(part "${IMAGES:-20000}" | cut -d. -f1)" 400
  ;;
crops)
  cd "$work"
  train crops "$root/export/weights/densepose-b.pt" 8 --lr 2e-3 --decay 0.02
  ;;
both)
  [ $# = 2 ] || { echo "usage: train-from-pack.sh both OUT" >&2; exit 2; }
  mkdir -p "$2" && out=$(realpath "$2") && cd "$work"
  train both .data/runs/crops/weights.pt 8 --lr 1e-3 --boxes-every 2 --decay 0.3
  for file in weights.pt log.json curves.png; do cp ".data/runs/both/$file" "$out/"; done
  ls -l "$out"
  ;;
*)
  sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0"
  exit 2
  ;;
esac
