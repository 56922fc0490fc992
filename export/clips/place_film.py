"""Films places of `export.places`: cameras that move, and parts of the place that do. Motion is exact, also that of
what lies behind everything, which is infinitely far away. Glass is looked through: what it mirrors moves otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import moderngl
import numpy as np

from export.camera import Camera
from export.clips.render import Labels, projection, view_matrix
from export.places import shaders
from export.places.catalogue import Asset, Stock
from export.places.mesh import Part
from export.places.render import FAR, Renderer

_BEHIND_M = 1e4  # depth of what lies behind everything
_SMALLEST_PX = 192  # longer side of what is drawn, before it is averaged down
_CORNER = (("position", 3), ("normal", 3), ("uv", 2), ("cut", 1))  # floats of a corner in the renderer's buffers

_VERTEX = """#version 330
in vec3 position; in vec3 next_position; in vec2 uv; in float cut;
uniform mat4 projection, view, next_view;
out vec3 next_seen; out float depth; out vec2 v_uv; out float v_cut;
void main() {
  vec4 seen = view * vec4(position, 1);
  gl_Position = projection * seen;
  depth = seen.z; next_seen = (next_view * vec4(next_position, 1)).xyz; v_uv = uv; v_cut = cut;
}"""

_FRAGMENT = """#version 330
in vec3 next_seen; in float depth; in vec2 v_uv; in float v_cut;
uniform sampler2D albedo; uniform vec4 pinhole; uniform float thing;
layout(location = 0) out vec4 motion; layout(location = 1) out float found;
void main() {CUTTING
  vec2 then = next_seen.xy / next_seen.z * pinhole.xy + pinhole.zw;
  motion = vec4(then - (gl_FragCoord.xy - .5), next_seen.z, thing);
  found = depth;
}"""


@lru_cache(maxsize=1)
def stock_of(split: str) -> Stock:
    """The stock of environments and people of a split. Loading takes seconds, once a process."""
    return Stock(split)


def asset_facts(assets: Sequence[Asset]) -> list[dict]:
    """Packages with their licences, as facts of a clip have them."""
    found = {(f"{a.package} {a.version}", a.licence, a.name) for a in assets}
    return [{"name": name, "licence": licence, "used": used} for name, licence, used in sorted(found)]


@dataclass(frozen=True, eq=False)
class PlaceMoment:
    """moving: the parts that move, where they are now."""

    camera: Camera
    moving: tuple[Part, ...] = ()


class PlaceFilm:
    """renderer: of a place whose last parts move; owners: number from 2 of the thing that each of these belongs to.
    What stands still is thing 1."""

    def __init__(self, renderer: Renderer, exposure: float, owners: Sequence[int] = ()) -> None:
        self.renderer, self.exposure = renderer, exposure
        renderer.context.__enter__()
        self._programs = {}
        for name, cutting in (("whole", ""), ("cut", shaders.CUTTING)):
            fragment = _FRAGMENT.replace("CUTTING", cutting)
            self._programs[name] = renderer.context.program(vertex_shader=_VERTEX, fragment_shader=fragment)
        first = len(renderer.drawn) - len(owners)
        for drawn in renderer.drawn if owners else ():
            # Where a triangle is squeezed to nothing, as by a joint, the rasteriser would take samples for minutes.
            drawn.texture.anisotropy = 1.0
        self._drawn = []  # what is drawn, where it will be (None: it stands still), its array, its number
        for k, drawn in enumerate(renderer.drawn):
            if drawn.part.material.opacity < 1:
                continue
            later = None if k < first else renderer.context.buffer(reserve=drawn.part.corners.size * 4)
            number = 1 if k < first else owners[k - first]
            self._drawn.append((drawn, k - first, later, self._array(drawn, later), number))
        self._targets: dict[tuple[int, int], moderngl.Framebuffer] = {}

    def _array(self, drawn, later: moderngl.Buffer | None) -> moderngl.VertexArray:
        program, taken, layout = self._programs[drawn.program], [], []
        for name, count in _CORNER:
            layout.append(f"{count}f" if name in program else f"{4 * count}x")
            taken += [name] if name in program else []
        parts = [(drawn.buffer, " ".join(layout), *taken)]
        own = (drawn.buffer, "3f 24x", "next_position") if later is None else (later, "3f", "next_position")
        return self.renderer.context.vertex_array(program, [*parts, own])

    def colour(self, moment: PlaceMoment, sizes: Sequence[tuple[int, int]]) -> list[np.ndarray]:
        """The image, drawn once and averaged down to each (width, height), the last the largest: uint8 [H, W, 3]."""
        self.renderer.show(list(moment.moving))
        factor = max(1, round(_SMALLEST_PX / max(sizes[-1])))
        image = self.renderer.colour(moment.camera.resized(*(factor * side for side in sizes[-1])), self.exposure)
        return [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for size in sizes]

    def labels(self, moment: PlaceMoment, then: PlaceMoment, size: tuple[int, int]) -> Labels:
        """At the centres of the pixels of an image of that (width, height)."""
        self.renderer.show(list(moment.moving), shadows=False)
        camera, camera_then = moment.camera.resized(*size), then.camera.resized(*size)
        target = self._target(size)
        target.use()
        target.clear()
        self.renderer.context.enable_only(moderngl.DEPTH_TEST)
        near = self.renderer.near
        for program in self._programs.values():
            for name, matrix in (
                ("projection", projection(camera, near, FAR * near)),
                ("view", view_matrix(camera)),
                ("next_view", view_matrix(camera_then)),
            ):
                program[name].write(np.ascontiguousarray(matrix.T, np.float32).tobytes())
            program["pinhole"].value = (camera_then.fx_px, camera_then.fy_px, camera_then.cx_px, camera_then.cy_px)
        for drawn, k, later, array, number in self._drawn:
            if later is not None:
                later.write(np.ascontiguousarray(then.moving[k].corners, np.float32).tobytes())
            self._programs[drawn.program]["thing"].value = float(number)
            drawn.texture.use(0)
            array.render()
        planes = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(size[1], size[0], 4)
        depth = np.frombuffer(target.read(components=1, attachment=1, dtype="f4"), np.float32).reshape(size[1], size[0])
        seen = Labels(planes[..., :2].copy(), planes[..., 2].copy(), depth.copy(), planes[..., 3].astype(int))
        _add_behind(seen, camera, camera_then)
        return seen

    def _target(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        if size not in self._targets:
            context = self.renderer.context
            planes = [context.texture(size, 4, dtype="f4"), context.texture(size, 1, dtype="f4")]
            self._targets[size] = context.framebuffer(planes, context.depth_renderbuffer(size))
        return self._targets[size]


def _add_behind(labels: Labels, camera: Camera, then: Camera) -> None:
    """Motion and depth of pixels that show nothing near, in place: only the camera's turning moves them."""
    y, x = np.nonzero(labels.thing == 0)
    rays = np.stack([x, y, np.ones_like(x)], 1) @ np.linalg.inv(camera.intrinsics).T
    later = rays @ (then.rotation @ camera.rotation.T).T
    ahead = later[:, 2] > 1e-6
    at = later[:, :2] / np.where(ahead, later[:, 2], 1)[:, None] * (then.fx_px, then.fy_px) + (then.cx_px, then.cy_px)
    labels.motion[y, x] = np.where(ahead[:, None], at - np.stack([x, y], 1), 0)
    labels.depth[y, x] = _BEHIND_M
    labels.next_depth[y, x] = np.where(ahead, _BEHIND_M, -1)
