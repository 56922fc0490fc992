#!/bin/sh
# Trains dense pose further with a pack of photographs (docs/reference/formats.md), from the shipped weights:
#
#     scripts/train-people.sh label PACK     copies the pack; labels its photographs and those of export.photos
#     scripts/train-people.sh render         renders people as photographs show them
#     scripts/train-people.sh train          writes shards; trains on whole images and on crops of people
#
# Each command goes on where it stopped. All files lie below $WORK. The commands need .data/photos/train and
# .data/backgrounds/train (python -m export.photos fetch), and render needs python -m export.people.assets. On a virtual
# machine with AMX, run train by scripts/with-amx.sh.
# Environment: WORK (.data/runs/people), MINUTES to train (120), IMAGES to render (3600), COMPOSED images of people cut
# out (2000), PROCESSES of one thread each (1), CAP of photographs by prefix (gm=40), PYTHON (python3).
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
work=${WORK:-.data/runs/people} python=${PYTHON:-python3} processes=${PROCESSES:-1}
export PYTHONPATH="$root${PYTHONPATH:+:$PYTHONPATH}" OMP_NUM_THREADS=1
photos=$work/photos/pack

label() { # FOLDER...
  "$python" -m export.teachers --photos "$@" --out "$work/labels" --processes "$processes"
  "$python" -m export.teachers.facing --photos "$@" --labels "$work/labels" --out "$work/facing" --processes "$processes"
}

render() { # SPLIT IMAGES
  "$python" -m export.people.dataset --variety usual --out "$work/rendered" --split "$1" --images "$2" --per-shard 20 \
    --processes "$processes"
}

case ${1:-} in
label)
  [ $# = 2 ] || { echo "usage: train-people.sh label PACK" >&2; exit 2; }
  "$python" -m export.photos pack "$2" --data "$work"
  label .data/photos/train "$photos/train"
  label "$photos/heldout"
  ;;
render)
  render val 100
  render train "${IMAGES:-3600}"
  ;;
train)
  # A training that has begun keeps its data.
  [ -e "$work/run/checkpoint.pt" ] || "$python" -m export.teachers.shards --photos .data/photos/train "$photos/train" \
    --labels "$work/labels" --facing "$work/facing" --cap "${CAP:-gm=40}" --repeat 2 --composed "${COMPOSED:-2000}" \
    --consistent export/weights/densepose-b.pt export/weights/densepose-b-crops.pt --out "$work/shards/train"
  "$python" -m torch.distributed.run --standalone --nproc-per-node "$processes" -m export.densepose.train --recipe usual \
    --data "$work/rendered" --photos "$work/shards/train" --photo-fraction .65 --init export/weights/densepose-b.pt \
    --out "$work/run" --threads 1 --batch 5 --crops 10 --boxes-every 2 --lr 6e-4 --backbone-rate 0.3 \
    --ema 0.998 --decay 0.5 --minutes "${MINUTES:-120}"
  ;;
*)
  sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0"
  exit 2
  ;;
esac
