"""Small networks: one thread is faster than two that wait for each other on a busy machine."""

import pytest


@pytest.fixture(autouse=True)
def one_thread():
    torch = pytest.importorskip("torch", reason="the extra `train` is not installed: scripts/make-venv.sh train,dev")
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)
