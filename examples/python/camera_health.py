"""Prints what happens to the camera of a clip or stream: camera_health.py clip.mp4"""

import sys

import maquette

health = maquette.CameraHealth()
for frame in maquette.Source(sys.argv[1]):
    result = health.push(frame)
    if result.event != "ok":
        print(f"{result.began_s:.2f} s: {result.event}")
print(f"{health.stats['pushed_count']} frames")
