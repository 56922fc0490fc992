"""Prints the people that a camera sees, until Ctrl-C: live.py [source]"""

import sys

import maquette

source = sys.argv[1] if len(sys.argv) > 1 else "camera:"
with maquette.Pipeline(source, maquette.DensePoseModel(key_frame_interval=2)) as pipeline:
    try:
        for result in pipeline:
            print(f"{result.frame.timestamp_ns / 1e9:8.2f} s: {result.densepose}, {result.stats['run_ms']:.0f} ms")
    except KeyboardInterrupt:
        print(f"{pipeline.stats['result_count']} results, {pipeline.stats['dropped_frame_count']} frames dropped")
