"""A prior of heads with random numbers: small, but with everything that one has."""

import numpy as np

from export.heads.prior import FieldShape, Layer, Prior

SMALL = FieldShape(
    octaves=2, width=12, geometry_layers=3, feature=5, surface_width=10, surface_layers=2, personal_geometry_layers=2
)


def small_prior(
    shape: FieldShape = SMALL, shape_codes: int = 3, colour_codes: int = 2, anchors: int = 7, seed: int = 5
) -> Prior:
    rng = np.random.default_rng(seed)

    def numbers(*sizes: int, scale: float = 1.0) -> np.ndarray:
        return rng.normal(0, scale, sizes).astype(np.float32)

    def layers(indices, *codes: int) -> list[Layer]:
        sizes = [(shape.outputs(index), shape.inputs(index)) for index in indices]
        # Rows of one layer that differ in size, as those of trained bases do.
        return [
            Layer(numbers(*codes, m, n, scale=0.3) * numbers(m, 1), numbers(*codes, m, scale=0.1)) for m, n in sizes
        ]

    geometry, surface = shape.personal
    points = numbers(anchors, 3, scale=0.5)
    return Prior(
        shape,
        layers(range(shape.layers)),
        layers(geometry, shape_codes),
        layers(surface, colour_codes),
        sharpness=48.5,
        cut_point=np.array([0.01, 0.1, -1.25], np.float32),
        cut_normal=np.array([0, 0.6, -0.8], np.float32),
        bounds_min=np.array([-1.5, -1.75, -2], np.float32),
        bounds_max=np.array([1.5, 1.875, 2.125], np.float32),
        template_points=points,
        anchor_mean=points + numbers(anchors, 3, scale=0.02),
        anchor_linear=numbers(anchors, 3, shape_codes, scale=0.05),
        anchor_sigma=np.abs(numbers(anchors, scale=0.02)) + np.float32(0.01),
        landmarks={"nose_tip": np.array([0, -1.25, 0.1], np.float32), "chin": np.array([0.0, -0.9, -0.9], np.float32)},
    )
