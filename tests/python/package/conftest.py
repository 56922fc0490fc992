"""A head, its builder and its renderer, which several files need."""

import maquette
import pytest
from round_heads import BOX, COARSE_M, GREY, ROUND


@pytest.fixture
def builder():
    with maquette.HeadBuilder(ROUND, texture=False, threads=1) as made:
        yield made


@pytest.fixture(scope="session")
def head() -> maquette.Head:
    with maquette.HeadBuilder(ROUND, texture=False, threads=1) as made:
        made.add_photo(GREY, BOX)
        return made.fit(0)


@pytest.fixture(scope="session")
def renderer(head) -> maquette.HeadRenderer:
    return maquette.HeadRenderer(head.mesh(cell_m=COARSE_M), threads=1)
