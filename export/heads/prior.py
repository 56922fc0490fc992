"""The prior of heads in numpy: the field's bases, anchors, clip plane, landmarks.

The head frame: decimetres (dm), x to the person's left, y to the back, z up, the origin in the middle of the head.
sdk/src/head/field/field_shape.h has the field's formulas. Codes are whitened: of a head that nothing is known of, each
is normal with mean 0 and variance 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

SURFACE_OUTPUTS = 6  # logits of red, green and blue, then the template point
MAX_OCTAVES, MAX_WIDTH, MAX_LAYERS, MAX_CODES = 8, 256, 8, 512
MIN_ANCHORS, MAX_ANCHORS = 4, 16384
MAX_LANDMARKS, MAX_LANDMARK_NAME = 256, 64  # names in bytes
MAX_EXTENT_DM = 8.0
# Landmarks that programs look for in `Prior.landmarks`; others are allowed.
PLACES = (
    "nose_tip", "nose_bridge", "chin", "crown", "pupil_left", "pupil_right", "temple_left", "temple_right",
    "ear_top_left", "ear_top_right", "ear_bottom_left", "ear_bottom_right",
)  # fmt: skip


class PriorError(ValueError):
    """A prior, or a file of one, is not what it must be; the sentence says why."""


@dataclass(frozen=True)
class FieldShape:
    """Sizes of a head's field network. Layers are counted through: hidden ones of the geometry, its output, then the
    same of the surface."""

    octaves: int = 6
    width: int = 64  # of the hidden geometry layers
    geometry_layers: int = 4  # hidden ones
    feature: int = 31
    surface_width: int = 64
    surface_layers: int = 2  # hidden ones
    smoothing: float = 2e-4
    # The layers that differ from head to head: so many first ones of either network.
    personal_geometry_layers: int = 3
    personal_surface_layers: int = 1

    @property
    def encoding(self) -> int:
        """Numbers that a point is encoded as."""
        return 3 + 6 * self.octaves

    @property
    def first_surface_layer(self) -> int:
        return self.geometry_layers + 1

    @property
    def layers(self) -> int:
        return self.geometry_layers + 1 + self.surface_layers + 1

    def inputs(self, layer: int) -> int:
        if layer == 0:
            return self.encoding
        if layer == self.first_surface_layer:
            return 1 + self.feature + 3
        return self.width if layer < self.first_surface_layer else self.surface_width

    def outputs(self, layer: int) -> int:
        if layer == self.geometry_layers:
            return 1 + self.feature
        if layer == self.layers - 1:
            return SURFACE_OUTPUTS
        return self.width if layer < self.geometry_layers else self.surface_width

    @property
    def personal(self) -> tuple[list[int], list[int]]:
        """The layers that differ from head to head: of the geometry (shape codes), of the surface (colour codes)."""
        first = self.first_surface_layer
        return list(range(self.personal_geometry_layers)), list(range(first, first + self.personal_surface_layers))


@dataclass(frozen=True, eq=False)
class Layer:
    """weights: float32 [outputs, inputs], bias: [outputs]; bases have their codes before that."""

    weights: np.ndarray
    bias: np.ndarray


@dataclass(frozen=True, eq=False)
class Prior:
    """K shape codes, M anchors. Lengths in dm; arrays are float32."""

    shape: FieldShape
    constant: list[Layer]  # for each layer: the weights W0 that all heads share
    shape_bases: list[Layer]  # for each personal geometry layer: change by one unit of a code, [K, outputs, inputs]
    colour_bases: list[Layer]  # for each personal surface layer: [colour codes, outputs, inputs]
    sharpness: float  # s of the opacity along rays, 1/dm
    cut_point: np.ndarray  # [3], of the plane where a head ends, below the chin
    cut_normal: np.ndarray  # [3], of length 1, out of the head
    bounds_min: np.ndarray  # [3], where the field was learnt
    bounds_max: np.ndarray  # [3]
    template_points: np.ndarray  # [M, 3]: anchors on the template head, in its frame
    anchor_mean: np.ndarray  # [M, 3]: where they lie on a head with codes 0
    anchor_linear: np.ndarray  # [M, 3, K]: what a unit of a shape code adds
    anchor_sigma: np.ndarray  # [M]: standard deviation, each coordinate, of what the linear function leaves
    landmarks: dict[str, np.ndarray] = field(default_factory=dict)  # name -> [3] on the template head

    @property
    def shape_codes(self) -> int:
        return self.anchor_linear.shape[2]

    @property
    def colour_codes(self) -> int:
        return len(self.colour_bases[0].weights) if self.colour_bases else 0


def combined(prior: Prior, shape_codes: np.ndarray, colour_codes: np.ndarray) -> list[Layer]:
    """The layers of one head, float64: W0 + sum of codes times bases."""
    layers = [Layer(layer.weights.astype(np.float64), layer.bias.astype(np.float64)) for layer in prior.constant]
    for indices, bases, codes in zip(
        prior.shape.personal, (prior.shape_bases, prior.colour_bases), (shape_codes, colour_codes), strict=True
    ):
        codes = np.asarray(codes, np.float64)
        for index, basis in zip(indices, bases, strict=True):
            weights = layers[index].weights + np.tensordot(codes, basis.weights.astype(np.float64), 1)
            layers[index] = Layer(weights, layers[index].bias + codes @ basis.bias.astype(np.float64))
    return layers


def check_shape(shape: FieldShape) -> None:
    """Raises PriorError for sizes that the SDK does not take."""
    limits = {
        "octaves": (0, MAX_OCTAVES),
        "width": (1, MAX_WIDTH),
        "geometry_layers": (1, MAX_LAYERS),
        "feature": (0, MAX_WIDTH),
        "surface_width": (1, MAX_WIDTH),
        "surface_layers": (1, MAX_LAYERS),
        "smoothing": (1e-8, 1.0),
        "personal_geometry_layers": (0, shape.geometry_layers),
        "personal_surface_layers": (0, shape.surface_layers),
    }
    for name, (low, high) in limits.items():
        value = getattr(shape, name)
        if not low <= value <= high:
            raise PriorError(f"{name} of the field is {value}, but must be {low} to {high}.")


def check_prior(prior: Prior) -> None:
    """Raises PriorError for what the SDK would refuse (sdk/src/head/head_prior.h): arrays of other shapes, numbers that
    are not finite or out of range."""
    shape = prior.shape
    check_shape(shape)
    geometry, surface = shape.personal
    every = [("constant", prior.constant, range(shape.layers), ())]
    every.append(("shape_bases", prior.shape_bases, geometry, (prior.shape_codes,)))
    every.append(("colour_bases", prior.colour_bases, surface, (prior.colour_codes,)))
    for name, layers, indices, codes in every:
        if len(layers) != len(indices):
            raise PriorError(f"{name} has {len(layers)} layers, but the shape has {len(indices)}.")
        for layer, index in zip(layers, indices, strict=True):
            sizes = (*codes, shape.outputs(index), shape.inputs(index))
            _check_array(f"weights of layer {index} in {name}", layer.weights, sizes)
            _check_array(f"bias of layer {index} in {name}", layer.bias, sizes[:-1])
    for name, codes in (("shape", prior.shape_codes), ("colour", prior.colour_codes)):
        if codes > MAX_CODES:
            raise PriorError(f"There are {codes} {name} codes, but at most {MAX_CODES} can be used.")
    if not 0.1 <= prior.sharpness <= 1e5:
        raise PriorError(f"sharpness is {prior.sharpness}, but must be 0.1 to 1e5.")
    count, reach = len(prior.anchor_sigma), 2 * MAX_EXTENT_DM
    if not MIN_ANCHORS <= count <= MAX_ANCHORS:
        raise PriorError(f"There are {count} anchors, but must be {MIN_ANCHORS} to {MAX_ANCHORS}.")
    _check_array("cut_point", prior.cut_point, (3,), -MAX_EXTENT_DM, MAX_EXTENT_DM)
    _check_array("cut_normal", prior.cut_normal, (3,))
    if abs(np.linalg.norm(np.asarray(prior.cut_normal, np.float64)) - 1) > 1e-3:
        raise PriorError("cut_normal must have length 1.")
    tiny = np.finfo(np.float32).tiny
    _check_array("bounds_min", prior.bounds_min, (3,), -MAX_EXTENT_DM, -tiny)
    _check_array("bounds_max", prior.bounds_max, (3,), tiny, MAX_EXTENT_DM)
    _check_array("template_points", prior.template_points, (count, 3), -reach, reach)
    _check_array("anchor_mean", prior.anchor_mean, (count, 3), -reach, reach)
    _check_array("anchor_linear", prior.anchor_linear, (count, 3, prior.shape_codes), -reach, reach)
    _check_array("anchor_sigma", prior.anchor_sigma, (count,), np.float32(1e-5), 10)
    if len(prior.landmarks) > MAX_LANDMARKS:
        raise PriorError(f"There are {len(prior.landmarks)} landmarks, but at most {MAX_LANDMARKS} can be stored.")
    for name, point in prior.landmarks.items():
        if not 1 <= len(name.encode()) <= MAX_LANDMARK_NAME:
            raise PriorError(f"The name of a landmark, {name!r}, must have 1 to {MAX_LANDMARK_NAME} bytes.")
        _check_array(f"landmark {name}", point, (3,), -reach, reach)


def _check_array(name: str, values: np.ndarray, sizes: tuple[int, ...], low: float = -1e30, high: float = 1e30) -> None:
    if np.shape(values) != sizes:
        raise PriorError(f"{name} has the shape {np.shape(values)}, but must have {sizes}.")
    values = np.asarray(values, np.float32)
    if not ((values >= np.float32(low)) & (values <= np.float32(high))).all():  # false for NaN
        raise PriorError(f"{name} has numbers that are not finite, or not within {low:g} to {high:g}.")
