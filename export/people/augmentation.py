"""How often rendered people are small, tilted, crowded or seen from behind: the settings of a rendering.

`CLOSE` is what the shipped weights were trained and tested on: 320 x 256, mostly alone, upright and facing the camera.
`WIDE` shows what a webcam in a room and a phone video show: 640 x 512, people from 1/14 of the image's height up,
tilted images, a third of the people from behind, crowds in which boxes overlap.
`USUAL` shows people at the size of `WIDE` as photographs usually do: most upright and facing the camera, one in eight
small, half of those scattered or before a webcam in poses of photographs.
`ANIMALS` shows animals and nobody, for a detector of people to learn the difference
(`export.densepose.train_evidence`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Variety:
    """Settings of a rendering; every fraction is of the images or the people it applies to.

    generator: name written into shards; the same name means the same images.
    sizes: (width, height) in pixels, by shard number.
    layouts: fraction of the images, and the fractions of 1, 2, 3, … people in them.
    framings: of scattered people: (fraction, centre of the view and least and largest visible height in body heights).
    rolls: of the camera about its axis: (fraction, smallest and largest angle in degrees); drawn on top of the
        hand's unsteadiness.
    turned_around: fraction of the people who are turned by half a turn after their yaw was drawn.
    bare_chest, hat, hood: fractions of the people.
    animals_alone, animals_beside: fractions of the images without and with people that show animals.
    photo_poses: fraction of the people scattered or before a webcam that stand as people of photographs do
        (`photo_poses.json`), where there are such poses.
    """

    generator: str
    sizes: tuple[tuple[int, int], ...]
    layouts: dict[str, tuple[float, tuple[float, ...]]]
    framings: tuple[tuple[float, float, float, float], ...]
    rolls: tuple[tuple[float, float, float], ...] = ()
    turned_around: float = 0.0
    bare_chest: float = 0.06
    hat: float = 0.1
    hood: float = 0.05
    animals_alone: float = 0.0
    animals_beside: float = 0.0
    photo_poses: float = 0.25

    def draw_roll(self, rng: np.random.Generator) -> float:
        """Degrees by which the camera is rolled, either way; nothing is drawn where there are no `rolls`."""
        if not self.rolls:
            return 0.0
        _, low, high = self.rolls[rng.choice(len(self.rolls), p=[fraction for fraction, _, _ in self.rolls])]
        return float(rng.uniform(low, high) * rng.choice([-1, 1]))

    def turns_around(self, rng: np.random.Generator) -> bool:
        """Whether the next person shows the back where they would have shown the front."""
        return self.turned_around > 0 and rng.random() < self.turned_around


CLOSE = Variety(
    generator="people-4",
    sizes=((320, 256), (320, 256), (256, 320)),
    layouts={
        "empty": (0.1, ()),
        "scattered": (0.5, (0.48, 0.26, 0.13, 0.07, 0.04, 0.02)),
        "group": (0.18, (0, 0.24, 0.24, 0.18, 0.12, 0.09, 0.07, 0.06)),
        "webcam": (0.22, (0.54, 0.26, 0.13, 0.07)),
    },
    framings=(
        (0.38, 0.5, 1.05, 1.7),
        (0.16, 0.66, 0.75, 0.95),
        (0.16, 0.78, 0.45, 0.65),
        (0.08, 0.9, 0.28, 0.4),
        (0.22, 0.5, 1.8, 4.5),
    ),
)

WIDE = Variety(
    generator="people-5",
    sizes=((640, 512), (640, 512), (512, 640)),
    layouts={
        "empty": (0.1, ()),
        "scattered": (0.38, (0.42, 0.26, 0.15, 0.09, 0.05, 0.03)),
        "group": (0.14, (0, 0.24, 0.24, 0.18, 0.12, 0.09, 0.07, 0.06)),
        "crowd": (0.16, (0, 0.28, 0.22, 0.16, 0.12, 0.09, 0.07, 0.06)),
        "webcam": (0.22, (0.5, 0.28, 0.14, 0.08)),
    },
    framings=(
        (0.32, 0.5, 1.05, 1.7),
        (0.12, 0.66, 0.75, 0.95),
        (0.12, 0.78, 0.45, 0.65),
        (0.06, 0.9, 0.28, 0.4),
        (0.24, 0.5, 1.8, 4.5),
        (0.14, 0.5, 4.5, 11.0),
    ),
    rolls=((0.6, 0, 15), (0.3, 15, 60), (0.1, 60, 180)),
    turned_around=0.28,
    bare_chest=0.15,
    hat=0.18,
    hood=0.06,
    animals_alone=0.6,
    animals_beside=0.07,
)

USUAL = replace(
    WIDE,
    generator="people-6",
    layouts={
        "empty": (0.08, ()),
        "scattered": (0.36, (0.5, 0.26, 0.12, 0.06, 0.04, 0.02)),
        "group": (0.14, (0, 0.24, 0.24, 0.18, 0.12, 0.09, 0.07, 0.06)),
        "crowd": (0.12, (0, 0.28, 0.22, 0.16, 0.12, 0.09, 0.07, 0.06)),
        "webcam": (0.3, (0.54, 0.28, 0.12, 0.06)),
    },
    framings=(
        (0.3, 0.5, 1.05, 1.7),
        (0.17, 0.66, 0.75, 0.95),
        (0.18, 0.78, 0.42, 0.65),
        (0.13, 0.9, 0.22, 0.4),
        (0.16, 0.5, 1.8, 4.5),
        (0.06, 0.5, 4.5, 8.0),
    ),
    rolls=((0.76, 0, 12), (0.19, 12, 45), (0.05, 45, 180)),
    turned_around=0.08,
    bare_chest=0.1,
    hat=0.1,
    hood=0.05,
    photo_poses=0.5,
)

ANIMALS = replace(WIDE, generator="animals-1", layouts={"empty": (1.0, ())}, animals_alone=1.0)

VARIETIES = {"close": CLOSE, "wide": WIDE, "usual": USUAL, "animals": ANIMALS}
