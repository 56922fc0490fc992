"""Writes part, U and V of each pixel of the people in a photo: photo_to_iuv.py photo.jpg results/photo"""

import sys

import maquette

photo, out = sys.argv[1:3]
result = maquette.DensePose(preset="photo").run(photo)
result.save(out)  # _IUV.png, _INDS.png and .json
maquette.Frame(result.painted(photo)).save(f"{out}_painted.png")
for person in result.people:
    print(f"{person.score:.2f} at {[round(v) for v in person.box_px]}")
