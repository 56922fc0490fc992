"""Dressed people as things: what `export.people` draws, laid down as triangles that any camera may go around."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import scipy.sparse as sp

from export.people import assets
from export.people.atlas import Atlas
from export.people.body import Body, Shape, sample_phenotype
from export.people.motion import clip_pose, drawn_pose, load_clips, load_photo_poses
from export.people.render import Person
from export.people.scene import BODIES, SPLITS
from export.people.staging import Director
from export.people.wardrobe import Fabrics, Layer, Model
from export.places.mesh import Material, Part, part_of_prop


class Crowd:
    """People of one split: bodies, motion clips, fabrics that the other splits do not have."""

    def __init__(self, split: str, photos: list[np.ndarray]) -> None:
        self.split = split
        self.body = Body()
        self.model = Model(self.body, Atlas(self.body))
        self.clips = load_clips(split)
        self.director = Director(
            self.model, Fabrics(split, photos), self.clips, load_photo_poses(split), self.shape, BODIES[split], (1, 1)
        )
        skin = cv2.resize(cv2.imread(str(assets.skin_texture())), (1024, 1024), interpolation=cv2.INTER_AREA)
        self.skin = np.ascontiguousarray(skin[..., ::-1])
        faces = self.model.faces
        corner_of = (faces.reshape(-1), np.repeat(np.arange(len(faces)), 3))
        self.gather = sp.csr_matrix((np.ones(faces.size, np.float32), corner_of), (len(self.model.rest), len(faces)))

    def somebody(self, rng: np.random.Generator) -> tuple[list[Part], tuple[float, float, float]]:
        """A person with what belongs to them, on z = 0 at the origin, facing -y; and width, depth, height in metres."""
        pose = clip_pose(rng, self.clips) if rng.random() < 0.4 else drawn_pose(rng)
        actor = self.director.actor(rng, pose, 0.0)
        parts = [*self.parts(actor.person, rng), *(part_of_prop(p) for p in (*actor.person.worn, *actor.props))]
        points = np.concatenate([p.corners.reshape(-1, 3) for p in parts])
        low, high = points.min(0), points.max(0)
        middle = (low[:2] + high[:2]) / 2
        shift = np.array([-middle[0], -middle[1], max(0.0, -low[2])])
        return [p.moved(np.eye(3), shift) for p in parts], tuple(map(float, high - low))

    def shape(self, number: int) -> Shape:
        """Body `number` of this split."""
        return self.body.shape(sample_phenotype(np.random.default_rng([SPLITS[self.split], number])))

    def parts(self, person: Person, rng: np.random.Generator) -> list[Part]:
        """The body and what is on its skin, where its vertices are; rng: how fabrics lie."""
        corners = person.vertices[self.model.faces]
        face_normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal = self.gather @ face_normal
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
        return [self._layer(layer, corners, normal, rng) for layer in person.layers if len(layer.faces)]

    def _layer(self, layer: Layer, corners: np.ndarray, normal: np.ndarray, rng: np.random.Generator) -> Part:
        """The surface that the vertex shader of `export.people.render` makes of a layer; folds are left out."""
        rest, faces = self.model.rest[self.model.faces[layer.faces]], self.model.faces[layer.faces]
        wave, f = 0.0, layer.bulge_frequency
        if layer.bulge > 0:
            x, y, z = rest[..., 0], rest[..., 1], rest[..., 2]
            a, b, c = layer.phase
            wave = np.sin(x * f + a) * np.sin(z * f * 0.8 + b) + 0.6 * np.sin(y * f * 1.3 + z * f * 1.7 + c)
        own = normal[faces]
        at = corners[layer.faces] + own * np.asarray(layer.offset + layer.bulge * wave)[..., None]
        material = Material(self.skin, tuple(map(float, layer.tint)), float(layer.specular), float(max(layer.gloss, 2)))
        uv = self.model.texture_uv[layer.faces]
        if layer.texture is not None:
            turn = rng.uniform(0, 2 * np.pi) if rng.random() < 0.3 else 0.0
            around = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
            planar = np.stack([rest[..., 0] + 0.6 * rest[..., 1], rest[..., 2]], -1)
            uv = layer.repeats * planar @ around.T + rng.uniform(0, 1, 2)
            material = replace(material, texture=np.ascontiguousarray(layer.texture))
        return Part(at.astype(np.float32), own.astype(np.float32), uv.astype(np.float32), material, layer.cut)
