"""Shared fixtures. torch and numpy get one thread: a second would wait for a processor that another group of tests
uses. Signal handlers are put back. Slow objects are made once (the body, its atlas, a renderer of undressed
bodies)."""

import os
import signal
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")  # read when numpy and torch are loaded

import numpy as np
import pytest


@pytest.fixture(scope="module")
def one_thread():
    """Torch computes in one thread: tensors of tests are small."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture
def fixed_seed():
    """Torch draws the same random numbers in every test."""
    import torch

    torch.manual_seed(0)


@pytest.fixture
def signal_handlers():
    """Trainings handle SIGTERM and SIGINT; afterwards they are handled as before."""
    handlers = {name: signal.getsignal(name) for name in (signal.SIGTERM, signal.SIGINT)}
    yield
    for name, handler in handlers.items():
        signal.signal(name, handler)


@pytest.fixture(autouse=True)
def empty_curves(request, monkeypatch):
    """Trainings write an empty curves.png: drawing one takes longer than training. @pytest.mark.curves draws it."""
    if "export.training" in sys.modules and not request.node.get_closest_marker("curves"):
        monkeypatch.setattr("export.training.draw_curves", lambda log, path, *_: path.write_bytes(b""))


@pytest.fixture(scope="session")
def body():
    from export.people.body import Body

    return Body()


@pytest.fixture(scope="session")
def atlas(body):
    from export.people.atlas import Atlas

    return Atlas(body)


@pytest.fixture(scope="session")
def model(body, atlas):
    from export.people.wardrobe import Model

    return Model(body, atlas)


@pytest.fixture(scope="session")
def renderer(model, atlas):
    """Draws images of 160 x 256 pixels."""
    from export.people.lookup import LabelLookup
    from export.people.render import Renderer

    return Renderer(model, LabelLookup(atlas), np.full((16, 16, 3), 200, np.uint8), 160, 256)
