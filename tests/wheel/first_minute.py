"""The first program of a user: first_minute.py MEDIA OUT."""

import itertools
import sys
from pathlib import Path

import maquette

media, out = map(Path, sys.argv[1:])
photo = maquette.Source(f"image:{media / 'photo.jpg'}").read()
result = maquette.DensePose().run(photo)
assert len(result.people) == 1, result.people
photo.save(str(out / "saved.png"))
clip = maquette.ClipWriter(str(out / "saved.mp4"), fps=10)
for frame in itertools.islice(maquette.Source(f"video:{media / 'clip.mp4'}"), 5):
    clip.add(frame)
clip.finish()
assert maquette.sample("photo.jpg").read_bytes() == (media / "photo.jpg").read_bytes()
