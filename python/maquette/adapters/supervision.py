"""People as `supervision.Detections`, for its annotators, trackers and zones.

from maquette.adapters.supervision import detections
found = detections(people.run(rgb))
supervision.MaskAnnotator().annotate(rgb, found)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from maquette.densepose import DensePoseResult

if TYPE_CHECKING:
    import supervision


def detections(result: DensePoseResult) -> supervision.Detections:
    """Boxes, scores and masks of the people, in the order of `result.people`; class 0 is "person". `tracker_id` is
    `Person.id`."""
    import supervision

    count = len(result.people)
    if count == 0:
        return supervision.Detections.empty()
    return supervision.Detections(
        xyxy=np.array([person.box_px for person in result.people], np.float32),
        mask=result.person[None] == np.arange(1, count + 1, dtype=np.uint8)[:, None, None],
        confidence=np.array([person.score for person in result.people], np.float32),
        class_id=np.zeros(count, int),
        tracker_id=np.array([person.id for person in result.people], int),
        data={"class_name": np.full(count, "person")},
    )
