"""Builds a scene from posed photos, and renders it from above: new_view.py capture/ view.png"""

import sys

import maquette
import numpy as np

folder, out = sys.argv[1:3]
scene = maquette.Scene.build(folder, progress=maquette.ProgressLine())
low, high = scene.bounds
camera = maquette.PinholeCamera.looking_at(
    maquette.Intrinsics.centred(640, 480, fov_deg=60),
    eye=(low + high) / 2 + scene.up * np.ptp(scene.bounds, axis=0).max() / 2 + (high - low) / 4,
    target=(low + high) / 2,
    up=scene.up,
)
maquette.SceneRenderer(scene).run(camera).save(out)
print(scene)
