"""The table: each row a metric, each column a product. Which rows we lose follows from the values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.products.running import NO_MASKS


@dataclass(frozen=True)
class Row:
    """title: names what is measured. section: the heading above. values: by product, None where there is no value.
    better: 1 for larger, -1 for smaller, 0 for neither. digits: after the point. is_flattered: the labels favour
    MediaPipe."""

    section: str
    title: str
    values: dict[str, float | None]
    better: int
    digits: int
    is_flattered: bool = False

    @property
    def marked_title(self) -> str:
        return self.title + ("\\*" if self.is_flattered else "")

    def best(self, names: list[str]) -> tuple[str, float] | None:
        """The best of these products by the shown digits, the first of equal ones; None where none has a value."""
        known = [(name, round(self.values[name], self.digits)) for name in names if self.values.get(name) is not None]
        return max(known, key=lambda pair: self.better * pair[1], default=None) if self.better else None

    def equals(self, name: str, best: tuple[str, float] | None) -> bool:
        """Whether the product has the best value of those that a row compares."""
        value = self.values.get(name)
        return best is not None and value is not None and round(value, self.digits) == best[1]

    def shown(self, name: str) -> str:
        value = self.values.get(name)
        return "–" if value is None else f"{value:.{self.digits}f}"


def _dig(source: dict, path: str) -> float | None:
    value: object = source
    for key in path.split("/"):
        value = value.get(key) if isinstance(value, dict) else None
    return value if isinstance(value, int | float) else None


def _size_group(name: str) -> Callable[[dict], float | None]:
    return lambda product: next((g["recall"] for g in product.get("groups", []) if g["name"] == name), None)


# (title, path in the product's metrics or function of them, better, digits, is_flattered)
_PHOTOGRAPHS = [
    ("people found", "found", 1, 3, False),
    ("people found: test set", "sets/test/found", 1, 3, False),
    ("people found: fresh set", "sets/fresh/found", 1, 3, False),
    ("people found: held-out set", "sets/held out/found", 1, 3, False),
    ("people found, no other person's box touches", "found_alone", 1, 3, False),
    ("people found, boxes touch", "found_crowded", 1, 3, False),
    ("precision", "precision", 1, 3, False),
    ("false people in a photograph without people", "false_people", -1, 3, False),
    ("false people in a photograph of animals", "false_people_by_animals", -1, 3, False),
    ("mask IoU, missed people count as 0", "mask_iou", 1, 3, True),
    ("mask IoU of people whom all find", "common_mask_iou", 1, 3, True),
    ("keypoints within 0.1 torsos, missed people are wrong", "joints", 1, 3, True),
    ("keypoints within 0.1 torsos, people whom all find", "common_joints", 1, 3, True),
    ("left and right, people whom all find", "common_left_right", 1, 3, True),
]
FOREGROUND = "IoU of all people as one mask"
_CLIPS = [
    ("people found", "found", 1, 3, False),
    ("people found by mask IoU of 0.5", "found_by_mask", 1, 3, False),
    ("people found, 256 px and higher", _size_group("higher than 128 px"), 1, 3, False),
    ("people found, 128 to 256 px", _size_group("64 to 128 px"), 1, 3, False),
    ("people found, lower than 128 px", _size_group("box lower than 64 px"), 1, 3, False),
    ("precision", "precision", 1, 3, False),
    ("mask IoU, missed people count as 0", "mask_iou", 1, 3, False),
    ("mask IoU of people whom all find", "common_mask_iou", 1, 3, False),
    (FOREGROUND, "foreground_iou", 1, 3, False),
    ("limb joints within 0.1 torsos, missed people are wrong", "joints", 1, 3, False),
    ("limb joints within 0.1 torsos, people whom all find", "common_joints", 1, 3, False),
    ("shoulders and hips within 0.1 torsos, people whom all find", "common_torso_joints", 1, 3, False),
    ("left and right, people whom all find", "common_left_right", 1, 3, False),
    ("jitter of joints, % of the torso a frame, median", "joint_jitter_p50", -1, 2, False),
    ("jitter of joints, 90th percentile", "joint_jitter_p90", -1, 2, False),
    ("jitter of boxes, % of the diagonal a frame, median", "box_jitter_p50", -1, 2, False),
    ("jitter of boxes, 90th percentile", "box_jitter_p90", -1, 2, False),
    ("id switches", "ids/switches", -1, 0, False),
    ("IDF1", "ids/IDF1", 1, 3, False),
    ("HOTA", "ids/HOTA", 1, 3, False),
]
ALONE = "MediaPipe without masks: "  # begins the title of a row with the products that compute no masks
_TIMES = [
    ("frame of a clip, 1 core, ms", "clips/1/ms", -1, 1, False),
    ("frame of a clip, 2 cores, ms", "clips/2/ms", -1, 1, False),
    (f"{ALONE}frame of a clip, 2 cores, ms", "clips/2/ms", -1, 1, False),
    ("processor time of a frame, 1 core, ms", "clips/1/cpu_ms", -1, 1, False),
    ("processor time of a frame, 2 cores, ms", "clips/2/cpu_ms", -1, 1, False),
    ("people found in these frames", "clips/2/people", 0, 2, False),
    ("photograph, 1 core, ms", "photographs/1/ms", -1, 1, False),
    ("photograph, 2 cores, ms", "photographs/2/ms", -1, 1, False),
    (f"{ALONE}photograph, 2 cores, ms", "photographs/2/ms", -1, 1, False),
    ("processor time of a photograph, 2 cores, ms", "photographs/2/cpu_ms", -1, 1, False),
    ("people found in these photographs", "photographs/2/people", 0, 2, False),
    ("start of a process to the first result, s", "start_s", -1, 2, False),
    ("the same, processor time, s", "start_cpu_s", -1, 2, False),
    ("memory of the process (RSS), peak, MB", "peak_rss_mb", -1, 0, False),
    ("networks on disk, MB", "networks_mb", -1, 1, False),
    ("library on disk, MB", "library_mb", -1, 1, False),
]
SECTIONS = {"photographs": _PHOTOGRAPHS, "clips": _CLIPS, "times": _TIMES}


def rows_of(document: dict) -> list[Row]:
    """The rows of the measured sections of a document (`__main__.py`)."""
    rows = []
    for section, metrics in SECTIONS.items():
        products = document.get(section, {}).get("products", {})
        for title, path, better, digits, is_flattered in metrics if products else ():
            values = {name: path(own) if callable(path) else _dig(own, path) for name, own in products.items()}
            if title.startswith(ALONE):
                values = {name: values.get(name + NO_MASKS, value) for name, value in values.items()}
            if title.startswith("jitter"):  # stored as a fraction
                values = {name: None if value is None else 100 * value for name, value in values.items()}
            rows.append(Row(section, title, values, better, digits, is_flattered))
    return rows


def compared(row: Row, products: dict[str, dict]) -> list[str]:
    """Names of the products that a row compares: not those without masks, which have a row of their own. One that finds
    no single people takes part where all people are one mask."""
    return [
        name for name, own in products.items()
        if not name.endswith(NO_MASKS) and (own["has_people"] or row.title == FOREGROUND)
    ]  # fmt: skip


def losses(rows: list[Row], products: dict[str, dict]) -> list[str]:
    """A line for each row in which another product is better than each of ours."""
    lines = []
    for row in rows:
        names = compared(row, products)
        ours = [name for name in names if products[name]["is_ours"]]
        others = [name for name in names if name not in ours]
        own, other = row.best(ours), row.best(others)
        if own and other and row.better * (other[1] - own[1]) > 0:
            lines.append(f"{row.section}, {row.marked_title}: {other[0]} {row.shown(other[0])}, "
                         f"{own[0]} {row.shown(own[0])}")  # fmt: skip
    return lines
