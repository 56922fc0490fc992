"""Prints the size of the box in a depth image: box_size.py depth.png 60 (millimetres, horizontal angle of view)"""

import sys

import maquette

depth = maquette.Frame.open(sys.argv[1], depth_unit_m=0.001)
height_px, width_px = depth.shape
camera = maquette.Intrinsics.centred(width_px, height_px, fov_deg=float(sys.argv[2]))
result = maquette.Edges().run(depth, camera, curves=True)
for box in result.curves.boxes:
    print(box)
