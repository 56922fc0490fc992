"""Heads of a linear model of scanned people, in the vertices of `HeadShapes`: shapes that MakeHuman does not have.

`export.heads.scans.registration` makes the file from its source.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from export.heads.shapes import HeadShapes

SKIN_VERTICES = 11248  # of the source: face, head and neck; mouth, eyes and lashes follow
EYES = ((21451, 23021), (23021, 24591))  # of the source: the person's left eyeball and the right one
HELD_OUT = slice(4, None, 5)  # components that no training sees: tests have them at twice their size
SMILING = 0.35  # of the heads to train on
WIDER = 1.2  # identities to train on by the source's: rare people count as well
QUIET = ("browDown", "browInnerUp", "browOuterUp", "cheekPuff", "eyeSquint", "eyeWide", "eyeBlink", "mouthFrown",
         "mouthPress", "mouthStretch", "noseSneer")  # fmt: skip


@dataclass(frozen=True, eq=False)
class ScannedHeads:
    """neutral [V, 3], dm, head frame, in the vertices of `HeadShapes`; identity [K, V, 3]: a standard deviation of each
    component; expression [E, V, 3] of full ones, `names` [E]. The same of the source's own skin and eyeballs: `own`
    [W, 3], own_identity, own_expression, triangles own_faces [F, 3]; own_template [W, 3]: the template's point there.
    """

    neutral: np.ndarray
    identity: np.ndarray
    expression: np.ndarray
    names: np.ndarray
    own: np.ndarray
    own_identity: np.ndarray
    own_expression: np.ndarray
    own_faces: np.ndarray
    own_template: np.ndarray

    def vertices(self, shapes: HeadShapes, identity: np.ndarray, expression: np.ndarray) -> np.ndarray:
        """The vertices [V, 3] of a head with these coefficients [K] and shares of expressions [E], as `HeadShapes` has
        them: the skull's mean lies where the template's does."""
        out = self._moved(identity, expression)
        return out - self._off(shapes, out)

    def surface(self, shapes: HeadShapes, identity: np.ndarray, expression: np.ndarray) -> np.ndarray:
        """The same head's own surface, [W, 3]."""
        moves = np.tensordot(identity, self.own_identity, 1) + np.tensordot(expression, self.own_expression, 1)
        return self.own + moves - self._off(shapes, self._moved(identity, expression))

    def _moved(self, identity: np.ndarray, expression: np.ndarray) -> np.ndarray:
        moves = np.tensordot(identity, self.identity, 1) + np.tensordot(expression, self.expression, 1)
        return self.neutral.astype(np.float64) + moves

    @staticmethod
    def _off(shapes: HeadShapes, vertices: np.ndarray) -> np.ndarray:
        return vertices[shapes.skull].mean(0) - shapes.template[shapes.skull].mean(0)

    def sample_expression(self, rng: np.random.Generator, smiles: bool) -> np.ndarray:
        """Shares [E] of expressions with a closed mouth: a smile, or a little of two others."""
        out, names = np.zeros(len(self.names)), list(self.names)
        if smiles:
            size = rng.uniform(0.4, 1.0)
            for side in "LR":
                out[names.index(f"mouthSmile_{side}")] = size * rng.uniform(0.85, 1)
                out[names.index(f"cheekSquint_{side}")] = size * rng.uniform(0, 0.6)
        else:
            for name in rng.choice(QUIET, 2, replace=False):
                size = rng.uniform(0, 0.4)
                for side in "LR":
                    out[names.index(f"{name}_{side}")] = size * rng.uniform(0.7, 1)
        return out


def sample_coefficients(count: int, rng: np.random.Generator, held_out: bool) -> np.ndarray:
    """Identity [count]. held_out: with the components that training does not see, twice as large as in the source."""
    out = rng.normal(size=count)
    out[HELD_OUT] *= 2 if held_out else 0
    return out


def read_scanned_heads(path: Path) -> ScannedHeads:
    with np.load(path) as stored:
        return ScannedHeads(**{f.name: stored[f.name] for f in fields(ScannedHeads)})


def sample_scanned(scans: ScannedHeads, shapes: HeadShapes, rng: np.random.Generator) -> np.ndarray:
    """Vertices [V, 3] of a head to train on, of the components that trainings see."""
    identity = WIDER * sample_coefficients(len(scans.identity), rng, held_out=False)
    return scans.vertices(shapes, identity, scans.sample_expression(rng, smiles=rng.random() < SMILING))


def similarity(points: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Points [N, 3] moved, turned and scaled to be nearest to their targets [N, 3]."""
    middle, there = points.mean(0), targets.mean(0)
    u, size, vt = np.linalg.svd((points - middle).T @ (targets - there))
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    scale = (size * sign).sum() / ((points - middle) ** 2).sum()
    return scale * (points - middle) @ ((u * sign) @ vt) + there
