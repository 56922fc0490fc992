#!/bin/sh
# Trains the networks of prediction on a machine with a GPU and without a network, from one file
# (python -m export.prediction.pack make), in one command of ten minutes, which leaves everything below $WORK:
#
#     scripts/train-prediction-from-pack.sh prediction.pack OUT
#
# It makes collages of the pack's photographs, trains the autoencoder, writes codes, and trains the transformer. It copies
# weights (half precision, except the autoencoder's), logs and curves to OUT.
#
# Environment: WORK (/dev/shm/maquette-prediction), SECONDS_LEFT for all (560), PERCENT of the collages, the batches and
# the validation (100), PROCESSES for motion (5), PYTHON (python3, with torch, OpenCV, cffi), MAQ_LIBRARY (the SDK's).
set -eu
[ $# = 2 ] || { sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0"; exit 2; }
root=$(cd "$(dirname "$0")/.." && pwd)
work=${WORK:-/dev/shm/maquette-prediction} left=${SECONDS_LEFT:-560} percent=${PERCENT:-100} python=${PYTHON:-python3}
pack=$(realpath "$1")
mkdir -p "$2" "$work" && out=$(realpath "$2")
begun=$(date +%s)
export PYTHONPATH="$root:$root/python${PYTHONPATH:+:$PYTHONPATH}" OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"
export PYTHONUNBUFFERED=1
cd "$work"

part() { awk "BEGIN { n = int($1 * $percent / 100); print n < 2 ? 2 : n }"; }
spare() { # SHARE: minutes, that part of the time that is left, but for 25 s to end in
  awk "BEGIN { print ($left - ($(date +%s) - $begun) - 25) * $1 / 60 }"
}
keep() { # RUN NAME
  for file in weights.pt log.json curves.png sample.png; do
    [ ! -f ".data/runs/$1/$file" ] || cp ".data/runs/$1/$file" "$out/$2-$file"
  done
}

"$python" -m export.prediction.pack open "$pack"
for counts in "train 2500" "val 32"; do
  "$python" -m export.clips.dataset collages --split ${counts% *} --clips "$(part "${counts#* }")" \
    --processes "${PROCESSES:-5}"
done
sets="pushing shapes collages"
"$python" -m export.prediction.train_autoencoder --sets $sets --minutes "$(spare 0.24)" --batch "$(part 256)" --rate 1e-3 \
  --stills .data/backgrounds/train --validate-minutes 100
keep prediction-autoencoder autoencoder
"$python" -m export.prediction.codes --sets $sets --processes "${PROCESSES:-5}"
minutes=$(spare 0.95)
"$python" -m export.prediction.train_transformer --minutes "$minutes" --bf16 --batch "$(part 128)" --rate 1e-3 \
  --validate-frames "$(part 256)" --validate-minutes 3
keep prediction-transformer transformer
"$python" - "$out" <<'HALF'
import sys
from pathlib import Path

import torch

for path in Path(sys.argv[1]).glob("*-weights.pt"):
    if path.name.startswith("autoencoder"):
        continue
    stored = torch.load(path, weights_only=True)
    stored["net"] = {k: v.half() if v.dtype == torch.float32 else v for k, v in stored["net"].items()}
    torch.save(stored, path)
HALF
ls -l "$out"
