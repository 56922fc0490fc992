"""Records a camera until Ctrl-C, for `Source("take.maqrec")`: record.py camera: take.maqrec"""

import sys

import maquette

with maquette.Source(sys.argv[1]) as camera, maquette.Recorder(sys.argv[2], camera, jpeg_quality=90) as recorder:
    try:
        for frame in camera:
            recorder.add(frame)
    except KeyboardInterrupt:
        pass
    print(recorder.info)
