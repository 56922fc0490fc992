"""Labels of teachers for a photograph with one person."""

import numpy as np

from export.keypoints import NAMES
from export.teachers.label import PhotoLabels

SIZE = 200
BOX = np.array([[40, 20, 120, 180]], np.float32)


def labels(box=BOX, score=0.9, sure=True, outlined=True, **landmarks) -> PhotoLabels:
    """One person whose mask fills the box; landmarks by name (underscores for blanks), the others not visible."""
    point, visible = np.zeros((1, 33, 2), np.float32), np.zeros((1, 33), np.float32)
    for name, at in landmarks.items():
        point[0, NAMES.index(name.replace("_", " "))], visible[0, NAMES.index(name.replace("_", " "))] = at, 0.9
    mask = np.zeros((1, SIZE, SIZE), bool)
    x0, y0, x1, y1 = box[0].astype(int)
    mask[0, y0:y1, x0:x1] = True
    world = np.zeros((1, 33, 3), np.float32)
    flags = {"outlined": np.array([outlined]), "sure": np.array([sure])}
    return PhotoLabels(
        box=box, score=np.array([score], np.float32), **flags, point=point, visible=visible, world=world, mask=mask,
        doubt=0 * mask > 0,
    )  # fmt: skip
