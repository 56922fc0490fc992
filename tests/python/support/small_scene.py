"""Scene files of few points, written without the SDK: what `maquette scene build` would make of a model in torch."""

import numpy as np

from export.scenes.config import FEATURES
from export.scenes.fitting import FittedPoints
from export.scenes.scene_file import BLOCK, COEFFICIENTS, HEAD, MAGIC, PLACES, SLOPES, VERSION, SceneFile

BLOCK_POINTS = 700


def scene_of(model: FittedPoints, networks_sha256: str, coefficients: int = 2, places: int = 1) -> SceneFile:
    """coefficients, places: kinds of numbers, as in the file. A third of the points keep their mean alone. Up is y."""
    at = model.positions.numpy()
    rng = np.random.default_rng(0)
    varies = rng.random(len(at)) > 1 / 3
    head = np.zeros((), HEAD)
    head["magic"], head["version"], head["head_bytes"] = MAGIC, VERSION, HEAD.itemsize
    head["origin"], head["up"] = (0.5, -0.25, 1), (0, 1, 0)
    head["position_kind"], head["coefficient_kind"] = places, coefficients
    head["networks_sha256"] = np.frombuffer(bytes.fromhex(networks_sha256), np.uint8)
    order = np.argsort(at[:, 0], kind="stable")
    blocks, stored, kept, varying, first_varying = [], [], [], [], 0
    for first in range(0, len(order), BLOCK_POINTS):
        own = order[first : first + BLOCK_POINTS]
        own = np.concatenate([own[varies[own]], own[~varies[own]]])
        block = np.zeros((), BLOCK)
        block["first"], block["count"] = first, len(own)
        block["varying"], block["first_varying"] = varies[own].sum(), first_varying
        first_varying += int(block["varying"])
        local = (at[own] - head["origin"]).astype(np.float32)
        block["low"], block["high"] = local.min(0), local.max(0)
        if places == 1:
            block["place_step"] = (block["high"] - block["low"]) / 65535
            steps = np.where(block["place_step"] > 0, block["place_step"], 1)
            local = np.clip(np.rint((local - block["low"]) / steps), 0, 65535)
            block["high"] += 1e-4
        stored.append(local.astype(PLACES[places]).T.ravel())
        block["mean_step"] = block["slope_step"] = 1
        blocks.append(block)
        kept.append(own)
        varying.append(own[varies[own]])
    head["points"], head["varying"], head["blocks"] = len(at), first_varying, len(blocks)
    kept, varying = np.concatenate(kept), np.concatenate(varying)
    kind = COEFFICIENTS[coefficients]
    empty = SceneFile(
        head,
        np.array(blocks),
        np.concatenate(stored),
        np.zeros((len(kept), FEATURES), kind),
        np.zeros((len(varying), SLOPES), kind),
    )
    means, slopes = (x.detach().float().numpy() for x in (model.fit.mean, model.fit.slope))
    return empty.with_descriptors(means[kept], slopes[varying].reshape(-1, SLOPES))
