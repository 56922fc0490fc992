"""The manifest of a dense pose bundle (docs/reference/formats.md): five graphs, the chart weights, the surface grid,
and the networks of the crop pass, if it has its own."""

from __future__ import annotations

from pathlib import Path

from export import data_sources as sources
from export.bundle import BundleInfo, Signature
from export.bundle import write_manifest as write_bundle_manifest
from export.densepose.config import DecodeConfig, NetworkConfig
from export.densepose.data import MEAN, STD
from export.densepose.network import PersonEvidence
from export.surface_grid import FILE as SURFACE_GRID

GRAPHS = ("trunk", "rpn_fine", "rpn_coarse", "box_head", "dense_head")
CROP_GRAPHS = ("crop_trunk", "crop_dense_head")  # of bundles with networks of their own for person crops
KEYPOINTS = "keypoints"  # graph of bundles whose network has them
CHARTS, CROP_CHARTS = "charts.f32", "crop_charts.f32"
LEVELS = (2, 3, 4, 5, 6)
EVIDENCE = "person"  # output of the trunk where the network has it
TRAINING_DATA = (
    sources.RENDERED_PEOPLE.used_for("training, calibration"),
    sources.BODIES_AND_GARMENTS.used_for("rendering"),
    sources.MOTIONS.used_for("rendering"),
    sources.SKIN.used_for("rendering"),
    sources.MOTIONS_AND_FABRICS.used_for("rendering"),
    sources.PANORAMAS.used_for("rendering"),
    sources.BACKGROUNDS.used_for("rendering"),
    sources.PHOTOS_OF_PEOPLE.used_for("training, calibration"),
    sources.PHOTOS_OF_ANIMALS.used_for("training"),
    sources.LABELS_OF_PEOPLE.used_for("training"),
    sources.DETECTOR_TRUNK.used_for("first weights of the backbone"),
)


def signatures(network: NetworkConfig, crops: bool = False) -> dict[str, Signature]:
    """Inputs and outputs of each graph, with `crops` also of `CROP_GRAPHS`."""
    width, anchors = network.width, len(network.aspect_ratios)
    sizes = {k: [f"height/{2**k}", f"width/{2**k}"] for k in LEVELS}
    # P6 is every second cell of P5, rounded up; that is no plain quotient of the input.
    sizes[6] = ["height6", "width6"]

    def maps(name: str, levels: tuple[int, ...], channels: int) -> dict[str, list[int | str]]:
        return {f"{name}{k}": [1, *sizes[k], channels] for k in levels}

    def rpn(levels: tuple[int, ...]) -> Signature:
        return {"inputs": maps("p", levels, width), "outputs": maps("rpn", levels, 5 * anchors)}

    def rois(pool: int) -> dict[str, list[int | str]]:
        return {"rois": ["people", pool, pool, width]}

    pool, classes = network.dense_pool, network.coarse_classes + network.index_classes
    image = {"image": [1, 3, "height", "width"]}
    dense_head = {
        "inputs": rois(pool),
        "outputs": {"labels": ["people", pool, pool, 4 * classes], "surface": ["people", pool, pool, width]},
    }
    surface, points = ({name: ["people", pool, pool, channels]} for name, channels in
                       (("surface", width), (KEYPOINTS, 4 * network.keypoints)))  # fmt: skip
    crop_trunk = {"inputs": image, "outputs": maps("p", LEVELS[:1], width)}
    evidence = {EVIDENCE: [1, *sizes[4], 1]} if network.evidence else {}
    return {
        "trunk": {"inputs": image, "outputs": maps("p", LEVELS, width) | evidence},
        "rpn_fine": rpn(LEVELS[:1]),
        "rpn_coarse": rpn(LEVELS[1:]),
        "box_head": {"inputs": rois(network.box_pool), "outputs": {"boxes": ["people", 6]}},
        "dense_head": dense_head,
        **({KEYPOINTS: {"inputs": surface, "outputs": points}} if network.keypoints else {}),
        **({"crop_trunk": crop_trunk, "crop_dense_head": dense_head} if crops else {}),
    }


def write_manifest(
    folder: Path, info: BundleInfo, network: NetworkConfig, decode: DecodeConfig, crops: bool = False
) -> dict:
    """Describes the graphs and chart weights that lie in `folder` and writes `manifest.json`, which it returns.

    crops: whether networks of the crop pass are among them.

    Raises ValueError when a graph's inputs and outputs are not those of the format.
    """
    grid = (Path(__file__).parent / SURFACE_GRID).read_bytes()
    (folder / SURFACE_GRID).write_bytes(grid)
    task_keys = {
        "input": {
            "color": "RGB",
            "mean": [round(float(x), 3) for x in MEAN],
            "std": [round(float(x), 3) for x in STD],
            "multiple_of": 32,
            "long_side_px": decode.long_side,
        },
        "rpn": {
            "strides": list(network.rpn_strides),
            "anchor_sizes_px": list(network.anchor_sizes),
            "aspect_ratios": list(network.aspect_ratios),
            "pre_nms_top_k": decode.pre_nms_top_k,
            "post_nms_top_k": decode.post_nms_top_k,
            "nms_iou": decode.rpn_nms_iou,
        },
        "box_head": {
            "pool_size": network.box_pool,
            "strides": list(network.tap_strides),
            "canonical_level": network.canonical_level,
            "canonical_size_px": network.canonical_size,
            "delta_weights": list(network.delta_weights),
            "score_threshold": decode.score_threshold,
            "nms_iou": decode.box_nms_iou,
            "max_people": decode.max_people,
        }
        | ({} if decode.second_pass_threshold is None else {"second_pass_threshold": decode.second_pass_threshold})
        | ({"evidence_stride": PersonEvidence.STRIDE} if network.evidence else {}),
        "dense_head": {
            "pool_size": network.dense_pool,
            "stride": network.tap_strides[0],
            "output_size": 2 * network.dense_pool,
            "coarse_classes": network.coarse_classes,
            "index_classes": network.index_classes,
            "mask_threshold": decode.mask_threshold,
            "min_visible_fraction": decode.min_visible_fraction,
        },
        **({KEYPOINTS: {"count": network.keypoints}} if network.keypoints else {}),
        "charts": {"file": CHARTS},
        "surface": {"file": SURFACE_GRID},
    }
    files = (CHARTS, SURFACE_GRID)
    if crops:
        files = (*files, CROP_CHARTS)
        task_keys["crop_charts"] = {"file": CROP_CHARTS}
    return write_bundle_manifest(
        folder, "densepose", info, signatures(network, crops), files=files, task_keys=task_keys
    )


def decode_config(manifest: dict) -> DecodeConfig:
    """Thresholds and limits that a manifest asks for."""
    rpn, head = manifest["rpn"], manifest["box_head"]
    return DecodeConfig(
        long_side=manifest["input"]["long_side_px"],
        pre_nms_top_k=rpn["pre_nms_top_k"],
        post_nms_top_k=rpn["post_nms_top_k"],
        rpn_nms_iou=rpn["nms_iou"],
        score_threshold=head["score_threshold"],
        box_nms_iou=head["nms_iou"],
        second_pass_threshold=head.get("second_pass_threshold"),
        max_people=head["max_people"],
        mask_threshold=manifest["dense_head"]["mask_threshold"],
        min_visible_fraction=manifest["dense_head"]["min_visible_fraction"],
    )
