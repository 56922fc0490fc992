"""The network's own layers compute what the standard ones do."""

import torch
from torch.nn import functional as F

from export.densepose.network import DepthwiseConv, _DepthwiseStride2


def test_halving_depthwise_convolution_has_the_gradients_of_the_plain_one():
    torch.manual_seed(0)
    for height, width in ((8, 12), (7, 9), (1, 2)):
        x, weight, bias = torch.randn(2, 5, height, width), torch.randn(5, 1, 3, 3), torch.randn(5)
        outputs, gradients = [], []
        for convolve in (_DepthwiseStride2.apply, lambda x, w, b: F.conv2d(x, w, b, 2, 1, groups=5)):
            given = [t.clone().requires_grad_() for t in (x, weight, bias)]
            outputs.append(convolve(*given))
            (outputs[-1] * torch.linspace(-1, 1, outputs[-1].numel()).view_as(outputs[-1])).sum().backward()
            gradients.append([t.grad for t in given])
        torch.testing.assert_close(*outputs)
        torch.testing.assert_close(*gradients)


def test_halving_depthwise_convolution_is_taken_while_training_in_bfloat16():
    torch.manual_seed(0)
    layer, x = DepthwiseConv(4, stride=2), torch.randn(1, 4, 8, 8)
    exact = layer(x)
    with torch.autocast("cpu", torch.bfloat16):
        rough = layer(x)
        with torch.no_grad():
            inference = layer(x)
    assert type(exact.grad_fn).__name__ == "ConvolutionBackward0"
    assert type(rough.grad_fn).__name__ == "_DepthwiseStride2Backward"
    assert rough.dtype == inference.dtype == torch.bfloat16
    torch.testing.assert_close(rough.float(), exact, atol=0.03, rtol=0.02)
    torch.testing.assert_close(rough, inference)
