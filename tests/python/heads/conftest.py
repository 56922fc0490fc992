"""An encoder of heads that several files need."""

import pytest


@pytest.fixture(scope="session")
def lively_encoder():
    """By a seed, an untrained encoder whose normalisation and fusion do something."""
    import torch

    from export.heads.encoder import HeadEncoder

    def made(seed: int) -> HeadEncoder:
        torch.manual_seed(seed)
        encoder = HeadEncoder()
        for module in encoder.modules():
            if isinstance(module, torch.nn.BatchNorm2d):
                module.running_mean.uniform_(-0.2, 0.2)
                module.running_var.uniform_(0.5, 1.5)
                torch.nn.init.uniform_(module.weight, 0.7, 1.3)
                torch.nn.init.uniform_(module.bias, -0.2, 0.2)
        for fusion in encoder.neck.fuse.values():
            torch.nn.init.uniform_(fusion.weight, -0.5, 1.5)
        return encoder.eval()

    return made
