"""Writes the head of a person as a mesh: photo_to_head.py photo.jpg head.glb [seconds]. Ask the person before."""

import sys

import maquette

photo, out = sys.argv[1:3]
seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 3.0
with maquette.HeadBuilder() as builder:
    builder.add_photo(photo)
    head = builder.fit(seconds, progress=maquette.ProgressLine())
head.mesh().save(out)
print(head, {name: landmark.point_m.round(3).tolist() for name, landmark in head.landmarks().items()})
