"""Draws dressed people with OpenGL (EGL, no window): colour and, per pixel, part, U, V, instance, surface point.

Camera axes: x right, y down, z forward (metres). Colour is drawn at `SUPERSAMPLING` times the image size
and averaged; labels are taken from one of the samples, since labels must not be mixed.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

os.environ.setdefault("LP_NUM_THREADS", "1")  # the software rasteriser; processes are the parallelism here

import cv2
import moderngl
import numpy as np
import scipy.sparse as sp

from export.people.lookup import LabelLookup
from export.people.wardrobe import Layer, Model

SUPERSAMPLING = 2

_VERTEX = """#version 330
in vec3 position; in vec3 normal; in vec3 rest; in vec2 texture_uv; in vec3 point;
uniform mat4 projection; uniform float offset, bulge, bulge_frequency; uniform vec3 phase;
uniform mat3 fabric; uniform bool planar;
out vec3 v_normal; out vec2 v_uv; out vec3 v_rest; out vec3 v_view; out vec3 v_point;
void main() {
  float f = bulge_frequency;
  float wave = sin(rest.x * f + phase.x) * sin(rest.z * f * .8 + phase.y)
             + .6 * sin(rest.y * f * 1.3 + rest.z * f * 1.7 + phase.z);
  vec3 p = position + normal * (offset + bulge * wave);
  gl_Position = projection * vec4(p, 1);
  v_normal = normal; v_rest = rest; v_view = -p; v_point = point;
  v_uv = planar ? (fabric * vec3(rest.x + .6 * rest.y, rest.z, 1)).xy : texture_uv;
}"""

_FRAGMENT = """#version 330
in vec3 v_normal; in vec2 v_uv; in vec3 v_rest; in vec3 v_view; in vec3 v_point;
uniform sampler2D albedo; uniform vec3 tint, sky, ground, up, light1, colour1, light2, colour2, phase;
uniform float wrinkle, wrinkle_frequency, specular, instance;
layout(location = 0) out vec4 colour; layout(location = 1) out vec4 point;
void main() {
  vec3 r = v_rest * wrinkle_frequency;
  vec3 n = v_normal + wrinkle * vec3(sin(r.z + 3. * sin(r.x * .5 + phase.x)),
                                     sin(r.x * 1.1 + 2. * sin(r.z * .6 + phase.y)), sin(r.z * .7 + r.x + phase.z));
  n = normalize(n);
  vec3 view = normalize(v_view);
  if (dot(n, view) < 0.) n = -n;
  float highlight = pow(max(0., dot(n, normalize(light1 + view))), 20.);
  vec3 light = mix(ground, sky, dot(n, up) * .5 + .5)
             + colour1 * max(0., dot(n, light1)) + colour2 * max(0., dot(n, light2));
  colour = vec4(texture(albedo, v_uv).rgb * tint * light + specular * colour1 * highlight, 1);
  point = vec4(v_point, instance);
}"""


@dataclass(frozen=True)
class Camera:
    """Pinhole: focal length and size in pixels, principal point in the middle; world_to_camera [3, 4]."""

    width: int
    height: int
    focal_px: float
    world_to_camera: np.ndarray


@dataclass(frozen=True)
class Light:
    """Hemisphere light and two directional lights; directions and `up` in camera axes, colours about 0..1."""

    up: np.ndarray
    sky: np.ndarray
    ground: np.ndarray
    directions: np.ndarray  # [2, 3] towards the light
    colours: np.ndarray  # [2, 3]


@dataclass(frozen=True)
class Person:
    """vertices [V, 3] in world axes, metres, and what to draw on them."""

    vertices: np.ndarray
    layers: list[Layer]


@dataclass(frozen=True)
class Picture:
    """rgb float32 [H, W, 3] (0..255, premultiplied), alpha float32 [H, W], label uint8 [H, W, 4] = (I, U, V, instance),
    point float32 [H, W, 3] of the template's surface, metres."""

    rgb: np.ndarray
    alpha: np.ndarray
    label: np.ndarray
    point: np.ndarray


class Renderer:
    """Owns the OpenGL context; one a process."""

    def __init__(self, model: Model, labels: LabelLookup, skin: np.ndarray, width: int, height: int) -> None:
        self.model, self.labels = model, labels
        self.context = moderngl.create_context(standalone=True, backend="egl")
        self.program = self.context.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
        size = (width * SUPERSAMPLING, height * SUPERSAMPLING)
        targets = [self.context.texture(size, 4), self.context.texture(size, 4, dtype="f4")]
        self.target = self.context.framebuffer(targets, self.context.depth_renderbuffer(size))
        self.size = size
        faces, count = model.faces, len(model.faces)
        fixed = [model.rest[faces], model.texture_uv, model.point]
        self.fixed = self.context.buffer(np.concatenate(fixed, 2).astype(np.float32).tobytes())
        self.moving = self.context.buffer(reserve=count * 3 * 24)
        ones = np.ones(count * 3, np.float32)
        corner_of = (faces.reshape(-1), np.repeat(np.arange(count), 3))
        self.gather = sp.csr_matrix((ones, corner_of), shape=(len(model.rest), count))
        self.skin = self.context.texture(skin.shape[1::-1], 3, np.ascontiguousarray(skin[::-1]).tobytes())
        self.skin.build_mipmaps()

    def _set(self, name: str, value) -> None:
        if name in self.program:  # the compiler drops uniforms that nothing uses
            self.program[name] = value

    def draw(self, people: list[Person], camera: Camera, light: Light, rng: np.random.Generator) -> Picture:
        """Instances are numbered 1.. in the order of `people`."""
        self.target.use()
        self.context.enable(moderngl.DEPTH_TEST)
        self.target.clear(0, 0, 0, 0)
        near, far = 0.05, 60.0
        x, y = 2 * camera.focal_px / camera.width, 2 * camera.focal_px / camera.height
        a, b = (far + near) / (far - near), -2 * far * near / (far - near)
        # y stays "down", so that the first row read back is the top row.
        matrix = np.array([[x, 0, 0, 0], [0, y, 0, 0], [0, 0, a, b], [0, 0, 1, 0]], np.float32)
        self.program["projection"].write(matrix.T.tobytes())
        self._set("up", tuple(light.up))
        self._set("sky", tuple(light.sky))
        self._set("ground", tuple(light.ground))
        for k in (0, 1):
            self._set(f"light{k + 1}", tuple(light.directions[k]))
            self._set(f"colour{k + 1}", tuple(light.colours[k]))
        rotation, shift = camera.world_to_camera[:, :3], camera.world_to_camera[:, 3]
        for number, person in enumerate(people, 1):
            self._place((person.vertices @ rotation.T + shift).astype(np.float32))
            self._set("instance", float(number))
            for layer in person.layers:
                self._layer(layer, rng)
        return self._read()

    def _place(self, vertices: np.ndarray) -> None:
        corners = vertices[self.model.faces]
        face_normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal = self.gather @ face_normal
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
        self.moving.write(np.concatenate([corners, normal[self.model.faces]], 2).astype(np.float32).tobytes())

    def _layer(self, layer: Layer, rng: np.random.Generator) -> None:
        if not len(layer.faces):
            return
        planar = layer.texture is not None
        texture = self.skin
        if planar:
            texture = self.context.texture((256, 256), 3, np.ascontiguousarray(layer.texture).tobytes())
            texture.build_mipmaps()
        texture.use(0)
        turn = rng.uniform(0, 2 * np.pi) if rng.random() < 0.3 else 0.0
        fabric = np.eye(3, dtype=np.float32)
        fabric[:2, :2] = layer.repeats * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        fabric[:2, 2] = rng.uniform(0, 1, 2)
        self.program["fabric"].write(fabric.T.tobytes())
        self._set("planar", planar)
        self._set("tint", tuple(map(float, layer.tint)))
        self._set("phase", tuple(map(float, layer.phase)))
        for name in ("offset", "bulge", "bulge_frequency", "wrinkle", "wrinkle_frequency", "specular"):
            self._set(name, float(getattr(layer, name)))
        index = (layer.faces[:, None] * 3 + np.arange(3)).astype(np.int32)
        indices = self.context.buffer(index.tobytes())
        names = [("rest", "3f"), ("texture_uv", "2f"), ("point", "3f")]
        skipped = [n in self.program for n, _ in names]
        layout = " ".join(f if used else f"{4 * int(f[0])}x" for (_, f), used in zip(names, skipped, strict=True))
        used = [n for (n, _), keep in zip(names, skipped, strict=True) if keep]
        array = self.context.vertex_array(
            self.program, [(self.moving, "3f 3f", "position", "normal"), (self.fixed, layout, *used)], indices
        )
        array.render()
        array.release()
        indices.release()
        if planar:
            texture.release()

    def _read(self) -> Picture:
        width, height = self.size
        small = (width // SUPERSAMPLING, height // SUPERSAMPLING)

        def plane(attachment: int, dtype: str, kind: type) -> np.ndarray:
            raw = self.target.read(components=4, attachment=attachment, dtype=dtype)
            return np.frombuffer(raw, kind).reshape(height, width, 4)

        colour, surface_point = plane(0, "f1", np.uint8), plane(1, "f4", np.float32)
        mean = cv2.resize(colour, small, interpolation=cv2.INTER_AREA).astype(np.float32)
        pick = np.s_[SUPERSAMPLING // 2 :: SUPERSAMPLING, SUPERSAMPLING // 2 :: SUPERSAMPLING]
        surface_point = surface_point[pick]
        label = np.zeros(surface_point.shape, np.uint8)
        label[..., 3] = surface_point[..., 3]
        body = label[..., 3] > 0
        label[body, :3] = self.labels.iuv(surface_point[body, :3])
        return Picture(mean[..., :3], mean[..., 3] / 255, label, surface_point[..., :3].copy())
