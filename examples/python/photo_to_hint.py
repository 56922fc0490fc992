"""Writes the hint image of a photo for ControlNet, or MagicAnimate: photo_to_hint.py photo.jpg a.png [magicanimate]"""

import sys

import maquette
from maquette.adapters.detectron2 import visualize

photo, out = sys.argv[1:3]
colours = sys.argv[3] if len(sys.argv) > 3 else "detectron2"
result = maquette.DensePose(preset="photo").run(photo)
maquette.Frame(visualize(result, colours=colours)).save(out)
