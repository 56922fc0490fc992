"""A template head small enough to damage each of its bits."""

import numpy as np

from export.heads.template_file import Kind, Template


def small_template() -> Template:
    """A tetrahedron whose tip is two vertices, a tooth inside, and two actions, one of which moves nothing."""
    return Template(
        points=np.array([[0, 0, 1], [1, 0, -0.5], [-0.5, 0.75, -0.5], [-0.5, -0.75, -0.5], [0, 0, 0.25]]),
        kinds=np.array([Kind.SURFACE] * 4 + [Kind.TEETH], np.uint8),
        vertex_points=np.array([0, 1, 2, 3, 0, 4]),
        uv=np.array([[0, 0], [0.25, 1], [0.5, 1], [0.75, 1], [1, 0], [0.5, 0.5]]),
        triangles=np.array([[0, 1, 2], [0, 2, 3], [4, 3, 1], [1, 3, 2]]),
        actions={
            "jawOpen": (np.array([0, 3]), np.array([[0, 0.05, -0.25], [0.001, 0, -0.3]])),
            "noseSneerLeft": (np.zeros(0, int), np.zeros((0, 3))),
        },
    )
