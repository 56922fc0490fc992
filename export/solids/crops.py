"""Stored data of a seed: training crops around its curves, or whole views with the curves."""

from __future__ import annotations

import numpy as np

from export.camera import Camera
from export.solids.curves import curves_json
from export.solids.labels import Labeller, Labels
from export.solids.recipe import FRAME_PX, Made, generator, make
from export.solids.records import LIMIT_R, NO_PATCH, Record, packed
from export.solids.views import Seen, View

CROP_PX = 128
VIEWS, CROPS_OF_VIEW = 3, 2
WHOLE_VIEWS = {"train": 2, "val": 3, "test": 2}
WHOLE_PX = (FRAME_PX, (640, 480))  # each whole view in both sizes
MAGNIFIED = max(width / FRAME_PX[0] for width, _ in WHOLE_PX)
_ANYWHERE = 0.2  # of the crops; the others lie about a curve
_TRIES = 6
_MIN_SEEN = 0.04  # of a crop's pixels


def _planes(view: View, labels: Labels) -> dict[str, np.ndarray]:
    distance = np.where(view.face >= 0, labels.distance, LIMIT_R)
    return {
        "depth": view.depth.astype(np.float32),
        "distance": distance.astype(np.float16),
        "kind": labels.kind,
        "ignore": labels.ignore,
        "patch": np.where(labels.patch >= 0, labels.patch, NO_PATCH).astype(np.uint16),
    }


def crops_of(split: str, seed: int, again: int = 0, views: int = VIEWS, of_view: int = CROPS_OF_VIEW) -> list[Record]:
    """`of_view` crops of each of `views` views, fewer where cameras see too little. again: as for `recipe.make`."""
    made = make(split, seed, views, again)
    rng = generator(split, seed, 1)
    found = []
    for number, camera in enumerate(made.cameras):
        seen = Seen(made.solid, camera)
        labeller = Labeller(seen)
        places = labeller.pixels_of_curves(camera)
        for k in range(of_view):
            view = _chosen(rng, seen, camera, places)
            if view is None:
                continue
            name = f"{split}/{seed:06d}/{number}/{k}/{made.family}/{made.stage}"
            found.append(packed(name, _planes(view, labeller.of(view)), _intrinsics(view.camera)))
    return found


def whole_views_of(split: str, seed: int, again: int = 0) -> list[Record]:
    """Each view in 320 x 240 and 640 x 480, with its curves."""
    return whole_views(f"{split}/{seed:06d}", make(split, seed, WHOLE_VIEWS[split], again, MAGNIFIED))


def whole_views(name: str, made: Made) -> list[Record]:
    """Records of WHOLE_PX of each camera, named {name}/{camera}/{size}/{family}/{stage}."""
    found = []
    for number, camera in enumerate(made.cameras):
        seen = Seen(made.solid, camera)
        labeller = Labeller(seen)
        for size in WHOLE_PX:
            view = seen.rendered(camera.resized(*size))
            labels = labeller.of(view)
            own = f"{name}/{number}/{size[0]}x{size[1]}/{made.family}/{made.stage}"
            curves = curves_json(labeller, labels.pieces)
            found.append(packed(own, _planes(view, labels), _intrinsics(view.camera), curves))
    return found


def _intrinsics(camera: Camera) -> tuple[float, float, float, float]:
    return camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px


def _chosen(rng: np.random.Generator, seen: Seen, camera: Camera, places: np.ndarray) -> View | None:
    """A frame of CROP_PX with enough in it, None after some tries."""
    room = camera.width_px - CROP_PX, camera.height_px - CROP_PX
    for _ in range(_TRIES):
        if rng.random() < _ANYWHERE or not len(places):
            corner = rng.integers(0, [room[0] + 1, room[1] + 1])
        else:
            middle = places[rng.integers(len(places))] + rng.uniform(-0.4, 0.4, 2) * CROP_PX
            corner = np.clip(np.round(middle - CROP_PX / 2), 0, room).astype(int)
        view = seen.rendered(camera.reframed(int(corner[0]), int(corner[1]), CROP_PX, CROP_PX))
        if (view.face >= 0).mean() >= _MIN_SEEN:
            return view
    return None
