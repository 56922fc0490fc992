"""What several files need and is slow to make: the body, its atlas, and a renderer of undressed bodies."""

import numpy as np
import pytest


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
    """Draws pictures of 160 x 256 pixels."""
    from export.people.lookup import LabelLookup
    from export.people.render import Renderer

    return Renderer(model, LabelLookup(atlas), np.full((16, 16, 3), 200, np.uint8), 160, 256)
