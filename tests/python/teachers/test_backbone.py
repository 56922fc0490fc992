"""The detector's backbone becomes ours: the same layers, and the same numbers for the same image."""

from types import SimpleNamespace

import numpy as np
import torch

from export.densepose import data
from export.densepose.network import MobileNetV2
from export.teachers import backbone as under_test


class FakeDetector:
    """Answers as cv2.dnn.Net does for the layers of TensorFlow's MobileNetV2, with the weights of `source`."""

    def __init__(self, source: MobileNetV2) -> None:
        self.blobs = {}
        self._add("Conv/Conv2D", "Conv/", source.stem)
        for k, block in enumerate(source.blocks):
            scope = f"expanded_conv_{k}/" if k else "expanded_conv/"
            if k:
                self._add(scope + "expand/Conv2D", scope + "expand/", block.expand)
            self._add(scope + "depthwise/depthwise", scope + "depthwise/", block.depthwise)
            self._add(scope + "project/Conv2D", scope + "project/", block.project)

    def _add(self, conv, scope, layer) -> None:
        bn = layer.bn
        norm = [t.detach().numpy() for t in (bn.running_mean, bn.running_var, bn.weight, bn.bias)]
        self.blobs["FeatureExtractor/MobilenetV2/" + conv] = [layer.conv.weight.detach().numpy()]
        self.blobs[f"FeatureExtractor/MobilenetV2/{scope}BatchNorm/batchnorm/add_1"] = norm

    def getLayerId(self, name):
        return name

    def getLayer(self, name):
        return SimpleNamespace(blobs=self.blobs[name])


def test_every_layer_is_taken_over_and_the_detector_s_normalisation_with_them(monkeypatch):
    torch.manual_seed(3)
    source = MobileNetV2().eval()
    for module in source.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.normal_(0, 0.2)
            module.running_var.uniform_(0.5, 2)
            torch.nn.init.uniform_(module.weight, 0.5, 1.5)
            torch.nn.init.normal_(module.bias)
    monkeypatch.setattr(under_test, "load_network", lambda: FakeDetector(source))
    ours = under_test.detector_backbone()
    for name, value in ours.state_dict().items():
        if not name.startswith("stem."):
            assert torch.equal(value, source.state_dict()[name]), name
    image = np.random.default_rng(0).integers(0, 256, (128, 128, 3), np.uint8)
    theirs = torch.from_numpy((image[..., ::-1].astype(np.float32) - 127.5) / 127.5).permute(2, 0, 1)[None]
    with torch.no_grad():
        expected, found = source(theirs)[0], ours(torch.from_numpy(data.normalised(image))[None])[0]
    inner = slice(8, -8)  # a border of zeros is another colour in either normalisation
    torch.testing.assert_close(found[..., inner, inner], expected[..., inner, inner], rtol=1e-3, atol=1e-3)
