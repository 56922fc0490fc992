"""Who stands, sits or lies where, among which things, and where the camera is.

World axes: z up, the ground at z = 0; the camera looks towards +y. Everybody is made facing the camera (-y).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from export.camera import Camera
from export.people.animals import Animal
from export.people.augmentation import CLOSE, Variety
from export.people.body import Shape
from export.people.motion import Clips, PhotoPoses, Pose, clip_pose, drawn_pose, lying, photo_pose, posed
from export.people.props import Prop, PropMaker
from export.people.render import Person
from export.people.wardrobe import Fabrics, Model, brim, dress

_LOOK = np.array([[1, 0, 0], [0, 0, -1], [0, 1.0, 0]])  # camera axes in the world before pitch and roll
_MIN_DEPTH = 0.9  # metres from the camera to a person who is not framed


@dataclass
class Stage:
    """Content of an image. `indoors`: the props have a floor; `roll_degrees`: the camera's tilt, if it has one."""

    people: list[Person]
    props: list[Prop]
    camera: Camera
    indoors: bool = False
    roll_degrees: float = 0.0


@dataclass
class Actor:
    """A dressed person at the origin with what belongs to them: seat, table, what they hold. `tall`: top above ground;
    `extent`: the larger of height and three quarters of the horizontal size, metres."""

    person: Person
    props: list[Prop]
    tall: float
    extent: float
    rests: str

    def moved(self, x: float, y: float) -> Actor:
        return Actor(self.person.moved(x, y), [p.moved(x, y) for p in self.props], self.tall, self.extent, self.rests)


@dataclass
class Aim:
    """A camera and what placing others needs to know of it."""

    camera: Camera
    eye: np.ndarray
    distance: float
    forward: np.ndarray
    right: np.ndarray
    width_per_depth: float = field(default=1.0)  # visible width at one metre


class Director:
    """Puts people, things and the camera into place; `shape(number)` gives body `number` of `bodies`."""

    def __init__(
        self,
        model: Model,
        fabrics: Fabrics,
        clips: Clips,
        photo_poses: PhotoPoses,
        shape: Callable[[int], Shape],
        bodies: int,
        size: tuple[int, int],
        variety: Variety = CLOSE,
        animals: tuple[Animal, ...] = (),
    ) -> None:
        self.model, self.fabrics, self.shape, self.bodies = model, fabrics, shape, bodies
        self.clips, self.photo_poses = clips, photo_poses
        self.width, self.height = size
        self.variety, self.animals = variety, animals
        self.maker = PropMaker(lambda rng: fabrics.draw(rng, worn=False))

    def stage(self, rng: np.random.Generator) -> Stage:
        layouts = self.variety.layouts
        name = list(layouts)[rng.choice(len(layouts), p=[fraction for fraction, _ in layouts.values()])]
        counts = layouts[name][1]
        count = 1 + int(rng.choice(len(counts), p=counts)) if counts else 0
        if name == "group":
            actors, aim = self._group(rng, count)
        elif name == "crowd":
            actors, aim = self._crowd(rng, count)
        elif name == "webcam":
            actors, aim = self._webcam(rng, count)
        else:
            actors, aim = self._scattered(rng, count)
        props = [p for a in actors for p in a.props]
        if name in ("empty", "scattered"):
            for _ in range(rng.poisson(0.5 if actors else 2.0)):
                depth = aim.distance * rng.uniform(0.5, 2.5)
                if depth > _MIN_DEPTH:
                    spot = self._spot(rng, aim, depth)
                    props.append(self.maker.standing(rng).moved(*spot[:2], rng.uniform(0, 6)))
        indoors = rng.random() < {"webcam": 0.4, "empty": 0.3}.get(name, 0.15)
        if indoors:
            behind = [a.person.vertices[self.model.torso, 1].max() + 0.3 for a in actors]
            far = max([aim.eye[1] + aim.distance, *behind]) + rng.uniform(0.3, 2.5)
            props += self.maker.room(rng, aim.eye, far)
        fraction = self.variety.animals_beside if actors else self.variety.animals_alone
        if self.animals and fraction and rng.random() < fraction:
            props += self._some_animals(rng, aim, alone=not actors)
        roll = self.variety.draw_roll(rng)
        return Stage([a.person for a in actors], props, aim.camera.rolled(roll), indoors, roll)

    def actor(self, rng: np.random.Generator, pose: Pose, yaw: float, table_fraction: float = 0.0) -> Actor:
        """Dresses a body in a pose, feet (or whatever is lowest) on z = 0, turned by `yaw` radians."""
        model, u = self.model, rng.uniform
        layers = dress(model, self.fabrics, rng, self.variety)
        if self.variety.turns_around(rng):
            yaw += np.pi
        vertices = posed(model.body, self.shape(int(rng.integers(self.bodies))), pose, rng)
        body = model.body.groups["body"]
        vertices -= [*vertices[body, :2].mean(0), vertices[body, 2].min()]
        props, front = [], float(vertices[model.torso, 1].min())
        if pose.rests == "sits":
            below = vertices[model.buttocks]
            height = float(np.quantile(below[:, 2], 0.03)) + 0.015
            x, y = below[below[:, 2] < height + 0.08][:, :2].mean(0)
            if height > 0.1 and u() < 0.85:
                back = float(vertices[model.torso, 1].max() - y) + 0.01
                props += [p.moved(x, y) for p in self.maker.seat(rng, height, back)]
            if u() < table_fraction:
                props += self.maker.table(rng, max(height + u(0.18, 0.32), 0.3), front - u(0.02, 0.15))
        elif pose.rests == "lies":
            if u() < 0.6:
                vertices[:, 2] += u(0, 0.55)
            lowest = vertices[body, 2].min() + 0.02  # the body sinks in a little
            low, high = vertices[body].min(0), vertices[body].max(0)
            props += self.maker.bed(rng, (low[0], low[1], lowest), high)
        elif u() < table_fraction * 0.4:
            props += self.maker.table(rng, u(0.7, 1.1), front - u(0.02, 0.3))
        if u() < 0.18:
            side = rng.integers(2)
            hand, arm = (vertices[index[side]].mean(0) for index in (model.hand, model.lower_arm))
            props.append(self.maker.held(rng, hand, arm))
        vertices = vertices @ Rotation.from_euler("z", yaw).as_matrix().T
        props = [p.moved(0, 0, yaw) for p in props]
        size = np.ptp(vertices[body], axis=0)
        tall = float(vertices[body, 2].max())
        person = Person(vertices, layers, brim(model, layers, vertices, rng))
        return Actor(person, props, tall, max(tall, 0.75 * float(size[:2].max())), pose.rests)

    def _photographed(self, rng: np.random.Generator) -> bool:
        """Whether the next pose is one of a photograph; only the split to train on has any."""
        return len(self.photo_poses.root) > 0 and rng.random() < self.variety.photo_poses

    def _anybody(self, rng: np.random.Generator) -> Actor:
        if self._photographed(rng):
            pose = photo_pose(rng, self.photo_poses)
        else:
            pose = clip_pose(rng, self.clips) if rng.random() < 0.5 else drawn_pose(rng)
        if rng.random() < 0.07:
            pose = lying(rng, pose)
            return self.actor(rng, pose, rng.uniform(-np.pi, np.pi))
        yaw = np.radians(rng.normal(0, 40) if rng.random() < 0.6 else rng.uniform(-180, 180))
        return self.actor(rng, pose, yaw, table_fraction=0.25)

    def _aim(self, target: np.ndarray, visible: float, degrees: float, pitch: float, roll: float) -> Aim:
        """A camera that shows `visible` metres of height at `target` [3]; angles in degrees, pitch > 0 looks down."""
        tangent = np.tan(np.radians(degrees) / 2)
        distance = max(visible / (2 * tangent), 0.35)
        rotation = Rotation.from_euler("xz", [pitch, roll], degrees=True).as_matrix() @ _LOOK
        eye = target - distance * rotation[2]
        camera = Camera.centred(self.width, self.height, self.height / (2 * tangent), rotation, eye)
        return Aim(camera, eye, distance, rotation[2], rotation[0], 2 * tangent * self.width / self.height)

    def _spot(self, rng: np.random.Generator, aim: Aim, depth: float) -> np.ndarray:
        return aim.eye + depth * aim.forward + rng.uniform(-0.6, 0.6) * depth * aim.width_per_depth * aim.right

    def _scattered(self, rng: np.random.Generator, count: int) -> tuple[list[Actor], Aim]:
        """The first person is framed; the others are around on the same ground."""
        u = rng.uniform
        actors = [self._anybody(rng) for _ in range(count)]
        tall, extent = (actors[0].tall, actors[0].extent) if actors else (1.7, 1.7)
        lies = bool(actors) and actors[0].rests == "lies"
        kind = rng.choice(len(self.variety.framings), p=[f[0] for f in self.variety.framings])
        _, middle, low, high = self.variety.framings[0 if lies and self._cuts_off(kind) else kind]
        visible = extent * u(low, high)
        shift = u(-0.35, 0.35) * visible * self.width / self.height * min(1, visible / extent)
        target = np.array([shift, 0, middle * tall + u(-0.08, 0.08) * visible])
        roll = rng.normal(0, 4) if u() < 0.9 else u(-50, 50)
        aim = self._aim(target, max(visible, 0.6), u(28, 68), rng.normal(22 if lies else 5, 12 if lies else 9), roll)
        taken, placed = [np.zeros(2)], actors[:1]
        for actor in actors[1:]:
            for _ in range(20):
                depth = aim.distance * u(0.75, 2.5) if u() < 0.6 else aim.distance + u(-0.4, 0.8)
                spot = self._spot(rng, aim, depth)
                if depth > _MIN_DEPTH and min(np.linalg.norm(spot[:2] - t) for t in taken) > 0.4:
                    taken.append(spot[:2])
                    placed.append(actor.moved(*spot[:2]))
                    break
        return placed, aim

    def _group(self, rng: np.random.Generator, count: int) -> tuple[list[Actor], Aim]:
        """Shoulder to shoulder in one or two rows, as people stand for a photograph or in a queue."""
        u = rng.uniform
        rows = 2 if count >= 4 and u() < 0.6 else 1
        front = count // rows
        spacing, turned = u(0.34, 0.62), (np.pi if u() < 0.12 else np.radians(rng.normal(0, 15)))
        front_sits = u() < 0.4
        actors = []
        for k in range(count):
            back_row = k >= front
            place, length = (k - front, count - front) if back_row else (k, front)
            x = (place - (length - 1) / 2 + (0.5 if back_row and length == front else 0)) * spacing
            sits = rows == 2 and front_sits and not back_row
            pose = clip_pose(rng, self.clips) if u() < 0.15 else drawn_pose(rng, 0.9 if sits else 0.05)
            yaw = turned + np.radians(rng.normal(0, 16)) if u() < 0.9 else u(-np.pi, np.pi)
            at = (x + rng.normal(0, 0.05), u(0.45, 0.8) * back_row + rng.normal(0, 0.08))
            actors.append(self.actor(rng, pose, yaw).moved(*at))
        tall = float(np.median([a.tall for a in actors]))
        wide = spacing * count / rows * self.height / self.width
        visible = u(0.45, 0.9) * tall if u() < 0.45 else max(u(1.02, 1.5) * tall, wide * u(0.7, 1.3))
        z = tall * (0.52 if visible > tall else 0.95) - (0 if visible > tall else u(0.25, 0.45) * visible)
        target = np.array([u(-0.25, 0.25) * spacing * front, 0.2, z])
        return actors, self._aim(target, visible, u(28, 65), rng.normal(3, 5), rng.normal(0, 2.5))

    def _crowd(self, rng: np.random.Generator, count: int) -> tuple[list[Actor], Aim]:
        """One behind another, as in a queue, on a pavement or before a stage: boxes overlap by a third and more."""
        u = rng.uniform
        together = u() < 0.7  # they look the same way
        heading = u(-np.pi, np.pi) if u() < 0.4 else np.radians(rng.normal(0, 30))
        depth, actors = 0.0, []
        for _ in range(count):
            pose = drawn_pose(rng, 0.08) if u() < 0.6 else clip_pose(rng, self.clips)
            yaw = heading + np.radians(rng.normal(0, 25)) if together else u(-np.pi, np.pi)
            actors.append(self.actor(rng, pose, yaw).moved(rng.normal(0, 0.2 + 0.07 * count), depth))
            depth += u(0.3, 1.1)
        tall = float(np.median([a.tall for a in actors]))
        visible = u(0.5, 0.95) * tall if u() < 0.3 else u(1.02, 2.6) * tall
        z = tall * 0.52 if visible > tall else tall - 0.4 * visible
        target = np.array([u(-0.3, 0.3), 0.3 * depth, z])
        return actors, self._aim(target, visible, u(25, 60), rng.normal(7, 6), rng.normal(0, 2.5))

    def _webcam(self, rng: np.random.Generator, count: int) -> tuple[list[Actor], Aim]:
        """Head and shoulders close to a wide lens, others beside or behind."""
        u = rng.uniform
        actors = []
        for k in range(count):
            sits = actors[0].rests == "sits" if k and u() < 0.7 else u() < 0.65
            if self._photographed(rng):
                pose = photo_pose(rng, self.photo_poses)
            else:
                pose = drawn_pose(rng, 1.0 if sits else 0.0)
            yaw = np.radians(rng.normal(0, 22)) if k == 0 or u() < 0.7 else u(-np.pi, np.pi)
            actors.append(self.actor(rng, pose, yaw, table_fraction=0.35 if k == 0 else 0.05))
        head = float(np.median(actors[0].person.vertices[self.model.skull, 2]))
        visible = u(0.36, 0.95) * (1 if count == 1 else u(1.0, 1.4))
        target = np.array([u(-0.22, 0.22) * visible, 0, head - u(-0.02, 0.3) * visible])
        roll = rng.normal(0, 3) if u() < 0.9 else u(-25, 25)
        aim = self._aim(target, visible, u(38, 75), rng.normal(2, 8), roll)
        placed = actors[:1]
        for k, actor in enumerate(actors[1:]):
            side = (-1) ** k * (1 if u() < 0.8 else -1)
            behind = u(-0.15, 0.35) if u() < 0.6 else u(0.5, 2.2)
            placed.append(actor.moved(side * u(0.32, 0.6) * (1 + k // 2) * (1 + 0.5 * behind), behind))
        return placed, aim

    def _some_animals(self, rng: np.random.Generator, aim: Aim, alone: bool) -> list[Prop]:
        """One to three animals on the ground: alone as large in the image as a subject, else of their own size."""
        visible = aim.distance * aim.width_per_depth * self.height / self.width
        placed = []
        for k in range(1 + int(rng.choice(3, p=[0.6, 0.25, 0.15]))):
            animal = self.animals[rng.integers(len(self.animals))]
            scale = rng.uniform(0.85, 1.15)
            spot = self._spot(rng, aim, max(aim.distance * rng.uniform(0.9, 2.0), _MIN_DEPTH))
            if alone:
                scale = visible * rng.uniform(0.25, 1.0) / animal.extent
                if not k:
                    spot = aim.eye + aim.distance * (aim.forward + rng.uniform(-0.2, 0.2) * aim.right)
            placed.append(animal.scaled(rng, scale).moved(*spot[:2], rng.uniform(-np.pi, np.pi)))
        return placed

    def _cuts_off(self, kind: int) -> bool:
        """Whether a framing shows less than the whole body."""
        return self.variety.framings[kind][2] < 1
