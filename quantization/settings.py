"""The settings of a quantization, read from a TOML file such as `quantization/densepose.toml`."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, TypeVar

from export.densepose import bundle as densepose
from export.edges import bundle as edges
from export.heads import bundle as heads
from export.prediction import bundle as prediction
from export.scenes import bundle as scenes

DENSEPOSE, EDGES, HEADS, PREDICTION, SCENES = (
    Path(__file__).with_name(f"{system}.toml") for system in ("densepose", "edges", "heads", "prediction", "scenes")
)
METHODS = ("minmax", "percentile", "entropy")


@dataclass(frozen=True)
class GraphSettings:
    """How one graph becomes int8.

    method: how the range of an activation follows from what calibration saw: its extremes ("minmax"), without
    the outermost 1 - `percentile` / 100 ("percentile"), or with the least information lost ("entropy").
    reduce_range: weights use 7 bits, so that two products never overflow 16 bits on x86 without VNNI.
    depthwise_8_bit: depthwise convolutions keep 8 bits all the same: their kernels add in 32 bits.
    float_nodes: names of nodes that stay float, `*` matches any text.
    round_together: weights are rounded so that their errors cancel on real inputs (quantization.graphs.rounding).
    bias_correction: biases take up the mean error that rounded weights cause.
    """

    method: str = "minmax"
    percentile: float = 99.999
    reduce_range: bool = True
    depthwise_8_bit: bool = False
    float_nodes: tuple[str, ...] = ()
    round_together: bool = False
    bias_correction: bool = False


@dataclass(frozen=True)
class DensePoseSettings:
    """graphs: settings by graph name. calibration_images,
    calibration_photos, held_out_images: how many images and photographs set the ranges, and how many images measure
    the error. people_per_image: at most so many people of an image calibrate the dense head.
    """

    GRAPHS: ClassVar[tuple[str, ...]] = (*densepose.GRAPHS, densepose.KEYPOINTS, *densepose.CROP_GRAPHS)

    graphs: dict[str, GraphSettings]
    calibration_images: int
    calibration_photos: int
    held_out_images: int
    people_per_image: int


@dataclass(frozen=True)
class SceneSettings:
    """graphs: settings by graph name. views, held_out_views: how many images calibrate, and measure the error."""

    GRAPHS: ClassVar[tuple[str, ...]] = scenes.GRAPHS

    graphs: dict[str, GraphSettings]
    views: int
    held_out_views: int


@dataclass(frozen=True)
class EdgeSettings:
    """graphs: settings by graph name. frames, held_out_frames: how many frames calibrate, and measure the error."""

    GRAPHS: ClassVar[tuple[str, ...]] = edges.GRAPHS

    graphs: dict[str, GraphSettings]
    frames: int
    held_out_frames: int


@dataclass(frozen=True)
class HeadSettings:
    """graphs: settings by graph name. bases: how those of the prior are stored, of export.heads.prior_file.FORMATS.
    crops, held_out_crops: how many crops calibrate, and measure the error. fitted_heads: how many heads measure what
    stored bases lose."""

    GRAPHS: ClassVar[tuple[str, ...]] = heads.GRAPHS

    graphs: dict[str, GraphSettings]
    bases: str
    crops: int
    held_out_crops: int
    fitted_heads: int


@dataclass(frozen=True)
class PredictionSettings:
    """graphs: settings by graph name. frames, held_out_frames: how many
    frames calibrate, and measure the error."""

    GRAPHS: ClassVar[tuple[str, ...]] = prediction.GRAPHS

    graphs: dict[str, GraphSettings]
    frames: int
    held_out_frames: int


Settings = TypeVar("Settings", DensePoseSettings, EdgeSettings, HeadSettings, PredictionSettings, SceneSettings)


def read_settings(path: Path, kind: type[Settings]) -> Settings:
    """Raises ValueError for unknown keys or methods."""
    values = tomllib.loads(path.read_text())
    graphs = {name: _graph_settings(values.pop(name, {}), f"{path}, [{name}]") for name in kind.GRAPHS}
    try:
        return kind(graphs, **values)
    except TypeError as error:
        raise ValueError(f"{path}: {error}") from error


def _graph_settings(table: dict[str, object], where: str) -> GraphSettings:
    """Reads the settings in a table of a file; `where` begins the sentence of a ValueError."""
    try:
        settings = GraphSettings(**{**table, "float_nodes": tuple(table.get("float_nodes", ()))})
    except TypeError as error:
        raise ValueError(f"{where}: {error}") from error
    if settings.method not in METHODS:
        raise ValueError(f"{where}: method {settings.method!r} is not one of {', '.join(METHODS)}")
    return settings
