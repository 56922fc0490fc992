"""What the encoder of a bundle sees in a photo, in numpy: for baselines that begin where the library begins."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnxruntime

from export.heads.anchor_fit import AnchorFitOptions, Observations
from export.heads.encoder import CELL_PX, CELLS, CROP_PX, LOG_SIGMA, MATTE, POINT
from export.heads.head_shards import CROP_SIDES
from export.teachers.faces import Square

MIN_MATTE, MAX_CELLS = 0.5, 600
SIGMAS_DM = (0.01, 3.0)
PIXEL_SIGMA_CELLS = 0.3


class Encoder:
    """The encoder's graph in ONNX Runtime."""

    def __init__(self, bundle: Path, threads: int = 1) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        self._session = onnxruntime.InferenceSession(str(bundle / "encoder.onnx"), options)

    def seen(self, rgb: np.ndarray, box: np.ndarray, focal_px: float = 0) -> tuple[Observations, AnchorFitOptions]:
        """Of the head in a box of a photo, uint8 RGB [H, W, 3]: as the library observes it, and the options of its fit
        (sdk/src/head/fit/anchor_fit.h). focal_px: 0 where it is not known."""
        square = Square((box[:2] + box[2:]) / 2 - 0.5, CROP_SIDES * float((box[2:] - box[:2]).max()), 0.0)
        crop = square.cut(np.ascontiguousarray(rgb), CROP_PX).astype(np.float32)
        cells, codes = self._session.run(["cells", "codes"], {"image": crop[None]})
        height, width = rgb.shape[:2]
        i, j = np.divmod(np.arange(CELLS**2), CELLS)
        pixels = square.to_photo((np.stack([j, i], 1) + 0.5) / CELLS)
        flat = cells[0].reshape(-1, cells.shape[-1]).astype(np.float64)
        inside = ((pixels >= -0.5) & (pixels < [width - 0.5, height - 0.5])).all(1)
        shown = np.flatnonzero(inside & (flat[:, MATTE] > np.log(MIN_MATTE / (1 - MIN_MATTE))))
        shown = shown[np.linspace(0, len(shown) - 1, min(MAX_CELLS, len(shown))).round().astype(int)]
        seen = Observations(
            flat[shown, POINT], np.exp(flat[shown, LOG_SIGMA]).clip(*SIGMAS_DM), pixels[shown], codes[0]
        )
        known = focal_px > 0
        options = AnchorFitOptions(
            focal_px=focal_px if known else float(max(height, width)),
            log_focal_sigma=1e-4 if known else AnchorFitOptions.log_focal_sigma,
            centre_px=((width - 1) / 2, (height - 1) / 2),
            pixel_sigma=PIXEL_SIGMA_CELLS * CELL_PX * square.size / CROP_PX,
        )
        return seen, options
