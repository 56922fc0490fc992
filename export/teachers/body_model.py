"""The body as something that can be fitted: 19 joints, a linear shape space, offsets for clothes, 33 landmarks; torch.

Bones that hardly move by themselves (fingers, toes, twist bones) go with the joint that carries them. Axes and units
are those of `export.people.body`: x to the person's left, y to the back, z up; metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import torch

from export.keypoints import NAMES
from export.people.atlas import REGIONS, smooth_normals, vertex_regions
from export.people.body import Body, sample_phenotype
from export.people.charts import Mesh
from export.people.landmarks import landmark_rows

# Joint: (its parent, the bone whose head it turns about, prefixes of the bones that go with it). Parents come first.
_MIDDLE = {
    "pelvis": ("", "root", ("root", "pelvis", "spine05")),
    "abdomen": ("pelvis", "spine04", ("spine04", "spine03")),
    "chest": ("abdomen", "spine02", ("spine02", "spine01")),
    "neck": ("chest", "neck01", ("neck",)),
    "head": ("neck", "head", ("head",)),
}
_SIDED = {
    "clavicle": ("chest", "clavicle", ("clavicle", "shoulder01")),
    "upper_arm": ("clavicle", "upperarm01", ("upperarm",)),
    "lower_arm": ("upper_arm", "lowerarm01", ("lowerarm",)),
    "hand": ("lower_arm", "wrist", ("wrist", "finger", "metacarpal")),
    "upper_leg": ("pelvis", "upperleg01", ("upperleg",)),
    "lower_leg": ("upper_leg", "lowerleg01", ("lowerleg",)),
    "foot": ("lower_leg", "foot", ("foot", "toe")),
}
SHAPES = 10  # principal components of bodies


def _joints() -> dict[str, tuple[str, str, tuple[str, ...], str]]:
    """Name: (parent, bone, prefixes, side), parents first."""
    out = {name: (*row, "") for name, row in _MIDDLE.items()}
    for side in "LR":
        for name, (parent, bone, prefixes) in _SIDED.items():
            parent = parent if parent in _MIDDLE else f"{parent}.{side}"
            out[f"{name}.{side}"] = (parent, f"{bone}.{side}", prefixes, side)
    return out


_TABLE = _joints()
JOINTS = tuple(_TABLE)
JOINT = {name: k for k, name in enumerate(JOINTS)}
PARENT = tuple(JOINT.get(row[0], -1) for row in _TABLE.values())


def mirrored_joint(name: str) -> str:
    return name[:-1] + {"L": "R", "R": "L"}[name[-1]] if "." in name else name


@dataclass(frozen=True)
class Pieces:
    """Some points of the body: rest float32 [K, 3] of the mean body, basis [SHAPES, K, 3], weights [K, 19] of the
    joints, normals [K, 3] at rest, region [K, 8] weights of `export.people.atlas.REGIONS`."""

    rest: torch.Tensor
    basis: torch.Tensor
    weights: torch.Tensor
    normals: torch.Tensor
    region: torch.Tensor


class Puppet:
    """Body in a shape and a pose. `sample` is a subset of the body's vertices, evenly spread; `whole` is all of them.

    `landmarks` holds the 33 landmarks in the order of `export.keypoints.NAMES`; `has_landmark` [33] says
    which of them the body has. joint_rest [19, 3], joint_basis [SHAPES, 19, 3]: where the joints are at rest.
    """

    def __init__(self, body: Body, samples: int = 900, bodies: int = 160) -> None:
        self.body = body
        count = len(body.base)
        rng = np.random.default_rng(0)
        shapes = [body.shape(sample_phenotype(rng)) for _ in range(bodies)]
        every = np.stack([np.concatenate([s.vertices, s.heads]) for s in shapes])
        every -= every[:, count + body.bone["root"], None]  # lengths are what counts, not where the floor is
        mean = every.mean(0)
        spread = (every - mean).reshape(bodies, -1)
        _, mixture = np.linalg.eigh(spread @ spread.T)  # far fewer bodies than coordinates
        mixture = mixture[:, ::-1][:, :SHAPES]
        basis = (mixture.T @ spread).reshape(SHAPES, *mean.shape) / np.sqrt(bodies)  # one standard deviation each

        group = np.zeros((len(body.bones), len(JOINTS)), np.float32)
        for name, (_, _, prefixes, side) in _TABLE.items():
            for k, bone in enumerate(body.bones):
                base, _, bone_side = bone.partition(".")
                if base.startswith(prefixes) and bone_side in ("", side or bone_side):
                    group[k, JOINT[name]] = 1
        assert (group.sum(1) == 1).all()
        weights = np.concatenate([body.skin @ group, group])
        regions = np.concatenate([vertex_regions(body), np.zeros((len(body.bones), len(REGIONS)))])
        faces = np.concatenate([f for name, f in body.faces.items() if not name.startswith("joint")])
        normals = smooth_normals(Mesh(mean[:count], faces, mean[:count, :1]), 1)
        normals = np.concatenate([normals, np.zeros((len(body.bones), 3))])

        def pieces(rows) -> Pieces:
            """`rows`: indices, or a matrix whose rows are means of points."""
            values = (mean, weights, normals, regions)
            if sp.issparse(rows):
                rest, w, n, r = (rows @ value for value in values)
                own = np.stack([rows @ b for b in basis])
            else:
                rest, w, n, r = (value[rows] for value in values)
                own = basis[:, rows]
            return Pieces(*(torch.tensor(np.asarray(a), dtype=torch.float32) for a in (rest, own, w, n, r)))

        skin = body.groups["body"]
        # Fingers and toes have too many vertices for what they tell: spread by distance.
        self.sample_index = skin[_spread(mean[skin], samples)]
        self.sample, self.whole = pieces(self.sample_index), pieces(np.arange(count))
        matrix = landmark_rows(body)
        # Corners of the eyes and the mouth say little about the pose of a body.
        self.has_landmark = np.array(
            [not name.startswith("mouth") and not name.endswith(("inner", "outer")) for name in NAMES]
        )
        self.template_nose = (matrix @ body.template.vertices)[NAMES.index("nose")]
        self.landmarks = pieces(sp.hstack([matrix, sp.csr_matrix((len(NAMES), len(body.bones)))]).tocsr())
        heads = count + np.array([body.bone[row[1]] for row in _TABLE.values()])
        joints = pieces(heads)
        self.joint_rest, self.joint_basis = joints.rest, joints.basis

    def bones(self, rotations: torch.Tensor, shape: torch.Tensor) -> torch.Tensor:
        """Affine map of each joint's bones, [19, 3, 4], the pelvis' joint staying at the origin.

        rotations [19, 3, 3]: orientation of each joint's bones, identity at rest; shape [SHAPES], standard deviations.
        """
        rest = self.joint_rest + torch.einsum("s,sjk->jk", shape, self.joint_basis)
        parents = list(PARENT[1:])
        steps = torch.einsum("jab,jb->ja", rotations[parents], rest[1:] - rest[parents])
        places = [torch.zeros(3)]
        for k, parent in enumerate(parents):
            places.append(places[parent] + steps[k])
        shift = torch.stack(places) - torch.einsum("jab,jb->ja", rotations, rest)
        return torch.cat([rotations, shift[..., None]], 2)

    @staticmethod
    def place(
        pieces: Pieces, bones: torch.Tensor, shape: torch.Tensor, clothes: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Points [K, 3] and unnormalised normals [K, 3]; clothes [8]: metres outwards, one for each of `REGIONS`."""
        blended = (pieces.weights @ bones.reshape(len(JOINTS), 12)).reshape(-1, 3, 4)
        rest = pieces.rest + torch.einsum("s,skx->kx", shape, pieces.basis)
        rest = rest + pieces.normals * (pieces.region @ clothes)[:, None]
        turned = blended[..., :3]
        return (turned @ rest[..., None])[..., 0] + blended[..., 3], (turned @ pieces.normals[..., None])[..., 0]


def turns(rotvec: torch.Tensor) -> torch.Tensor:
    """Rotation matrices [K, 3, 3] of rotation vectors [K, 3], radians (Rodrigues' formula)."""
    square = (rotvec * rotvec).sum(1)[:, None, None]
    angle = torch.sqrt(square + 1e-12)
    x, y, z = rotvec.T
    zero = torch.zeros_like(x)
    cross = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], 1).reshape(-1, 3, 3)
    return torch.eye(3) + torch.sin(angle) / angle * cross + (1 - torch.cos(angle)) / (square + 1e-12) * cross @ cross


def chained(local: torch.Tensor) -> torch.Tensor:
    """Orientations [19, 3, 3] from rotations of each joint relative to its parent [19, 3, 3]."""
    out = [local[0]]
    for k, parent in enumerate(PARENT[1:], 1):
        out.append(out[parent] @ local[k])
    return torch.stack(out)


def _spread(points: np.ndarray, count: int) -> np.ndarray:
    """Indices of points by farthest-point order."""
    chosen, nearest = [0], np.linalg.norm(points - points[0], axis=1)
    for _ in range(count - 1):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)
