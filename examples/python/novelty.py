"""Prints the moments of a clip in which something unexpected happens: novelty.py clip.mp4"""

import sys

import maquette

novelty = maquette.Novelty()
for frame in maquette.Source(sys.argv[1]):
    score = novelty.push(frame)
    if score.is_event:
        print(f"{frame.timestamp_ns / 1e9:.2f} s: {score}")
print(f"{novelty.stats['pushed_count']} frames")
