"""A node for ComfyUI: dense pose as the hint image of ControlNet or MagicAnimate, on the CPU.

Copy this folder to ComfyUI/custom_nodes/maquette, and install the package with ComfyUI's Python: pip install maquette
"""

import maquette
import numpy as np
import torch
from maquette.adapters.detectron2 import visualize


class MaquetteDensePose:
    """IMAGE is float32 [N, H, W, 3], 0 to 1; MASK is float32 [N, H, W], 1 on people."""

    CATEGORY = "image/preprocessors"
    FUNCTION = "run"
    RETURN_TYPES = ("IMAGE", "MASK")

    @classmethod
    def INPUT_TYPES(cls) -> dict:
        return {
            "required": {
                "image": ("IMAGE",),
                "colours": (["detectron2", "magicanimate"],),
                "long_side_px": ("INT", {"default": 0, "min": 0, "max": 2048, "step": 32}),  # 0: chosen by the package
                "preset": (["photo", "stream"],),
            }
        }

    def run(self, image: torch.Tensor, colours: str, long_side_px: int, preset: str) -> tuple:
        hints, masks = [], []
        with maquette.DensePose(long_side_px=long_side_px, preset=preset) as people:
            for pixels in (image.cpu().numpy() * 255).round().astype(np.uint8):
                result = people.run(pixels)
                hints.append(visualize(result, colours=colours))
                masks.append(result.part > 0)
        return (
            torch.from_numpy(np.stack(hints).astype(np.float32) / 255),
            torch.from_numpy(np.stack(masks).astype(np.float32)),
        )


NODE_CLASS_MAPPINGS = {"MaquetteDensePose": MaquetteDensePose}
NODE_DISPLAY_NAME_MAPPINGS = {"MaquetteDensePose": "Dense pose (Maquette)"}
