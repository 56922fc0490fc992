"""The MobileNetV2 inside the person detector (trained on COCO; Apache-2.0) as a start for our backbone.

    python -m export.teachers.backbone --out .data/teachers/backbone.pt
    python -m export.densepose.train --pretrained .data/teachers/backbone.pt …

From random weights two CPU cores need days to learn what a photograph looks like; this network has seen 118,000.
TensorFlow pads strided convolutions at the end, torch at both sides: the same function on a grid moved by a pixel
a level, which no later layer can tell except at the border.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import torch

from export.densepose.data import MEAN, STD
from export.densepose.network import ConvBn, MobileNetV2
from export.teachers.detector import load_network

_SCOPE = "FeatureExtractor/MobilenetV2/"


def detector_backbone() -> MobileNetV2:
    """The detector's layers in our names; takes our normalised images (`export.densepose.data`)."""
    network, backbone = load_network(), MobileNetV2()
    _fill(backbone.stem, network, "Conv/Conv2D", "Conv/")
    for k, block in enumerate(backbone.blocks):
        scope = f"expanded_conv_{k}/" if k else "expanded_conv/"
        if k:
            _fill(block.expand, network, scope + "expand/Conv2D", scope + "expand/")
        _fill(block.depthwise, network, scope + "depthwise/depthwise", scope + "depthwise/")
        _fill(block.project, network, scope + "project/Conv2D", scope + "project/")
    # The detector wants (x - 127.5) / 127.5 in RGB; ours is (x - MEAN) / STD.
    stem, std, mean = backbone.stem, torch.from_numpy(STD / 127.5), torch.from_numpy(MEAN / 127.5 - 1)
    stem.bn.running_mean -= (stem.conv.weight.detach().sum((2, 3)) * mean).sum(1)
    stem.conv.weight.data *= std[None, :, None, None]
    return backbone.eval()


def _fill(layer: ConvBn, network: cv2.dnn.Net, conv: str, scope: str) -> None:
    def blobs(name: str) -> list[torch.Tensor]:
        return [torch.from_numpy(b.copy()) for b in network.getLayer(network.getLayerId(_SCOPE + name)).blobs]

    (weight,) = blobs(conv)
    mean, variance, gamma, beta = (b.flatten() for b in blobs(scope + "BatchNorm/batchnorm/add_1"))
    state = {
        "conv.weight": weight,
        "bn.running_mean": mean,
        "bn.running_var": variance,
        "bn.weight": gamma,
        "bn.bias": beta,
    }
    layer.load_state_dict(state | {"bn.num_batches_tracked": torch.tensor(0)})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(".data/teachers/backbone.pt"))
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    torch.save(detector_backbone().state_dict(), options.out)
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main()
