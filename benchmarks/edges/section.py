"""Writes the section "Edges" of the report."""

from __future__ import annotations

from benchmarks.edges.methods import FLOAT, NOTHING, SHIPPED
from benchmarks.edges.plots import front_of
from benchmarks.edges.quality import LEVELS
from benchmarks.edges.section_of_views import SAYS, carton_parts, fusion_parts, round_parts
from benchmarks.edges.speed import SCENES

COLUMNS = {"rmse_r": ("RMSE, r", 1, ".2f"), "rmse_near_r": ("near edges, r", 1, ".2f"), "q95_r": ("95 %, r", 1, ".1f"),
           "recall_1r": ("recall at r, %", 100, ".1f"), "fpr_1r": ("false, %", 100, ".2f"),
           "recall_4r": ("at 4 r, %", 100, ".1f"), "fpr_4r": ("false, %", 100, ".2f")}  # fmt: skip
ANCHORS = [
    ["another data set, published values", "RMSE, r", "recall, %", "false, %"],
    ["DEF (78.6 M parameters), clean synthetic patches, at r", "0.56", "80.0", "0.02"],
    ["Voronoi covariance (VCM), the same patches, at r", "", "about 40", "about 5"],
    ["DEF, real scans by structured light, at 4 r", "3", "91.7", ""],
]


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of edges.measure with any of its parts."""
    parts: list = [f"Warnings of the measurement: {'; '.join(measured['warnings'])}."] if measured["warnings"] else []
    if "errors" in measured:
        parts += error_parts(measured)
    if "curves" in measured:
        parts += curve_parts(measured)
    if "speed" in measured:
        parts += [
            *speed_parts(measured["speed"]),
            saving_rows(measured["savings"]),
            "Work that is left out, 320 x 240: the time with the option by that without, the part of the frame that "
            "the network ran on, and how far the field is from the one without it (root mean square, and pixels on the "
            "other side of r).",
            scene_rows(measured["curves_of_scenes"]),
        ]
    parts += fusion_parts(measured.get("fusion"), measured.get("fusion_times"))
    parts += carton_parts(measured.get("carton"))
    parts += round_parts(measured.get("round"))
    return "Edges", parts


def error_parts(measured: dict) -> list:
    views = measured["views"]
    parts: list = [
        "Distance of each pixel of a depth frame to the nearest sharp curve, in r = depth / focal length. Data: "
        f"{views['test']} views (320 x 240) of {views['solids']} rendered solids whose families neither training nor "
        f"the choice of thresholds saw. Thresholds of all methods are chosen on {views['val']} validation views.",
        error_rows(measured["errors"]),
        "Values are means over views. Near edges: pixels within 4 r of an edge. A pixel counts as sharp if its "
        "distance is below a threshold. The threshold allows false positives on 0.5 % (for r) or 2 % (for 4 r) of the "
        "validation pixels that are farther from an edge. Recall: fraction of sharp pixels among test pixels nearer "
        "than r or 4 r; false: fraction among the others. Baselines use the thresholds with the smallest RMSE; pixels "
        "nearer than r or 4 r to their edges count as sharp. Time: the library for our networks; Python and OpenCV "
        "for baselines.",
        ANCHORS,
        *sheet_parts(measured["sheet"]),
    ]
    missing = [f"{name} ({why})" for name, why in measured["missing"].items() if why]
    parts += [f"Not measured: {'; '.join(missing)}."] if missing else []
    if measured["agreement"]:
        parts.append(agreement_rows(measured))
    parts += [noise_rows(measured["errors"])]
    parts += set_parts(measured["sets"])
    return parts + group_parts(measured["groups"])


def cells(row: dict) -> list[str]:
    return ["" if row[key] is None else format(scale * row[key], form) for key, (_, scale, form) in COLUMNS.items()]


def heads() -> list[str]:
    return [head for head, _, _ in COLUMNS.values()]


def error_rows(rows: list[dict]) -> list[list[str]]:
    table = [["depth, method", *heads(), "ms"]]
    for level in LEVELS:
        of_level = [row for row in rows if row["level"] == level]
        for row in of_level:
            ms = "" if row["way"] == NOTHING else f"{row['ms']:.1f}"
            table.append([f"{SAYS[level]}: {row['way']}", *cells(row), ms])
    return table


def agreement_rows(measured: dict) -> list[list[str]]:
    rmse = {(row["level"], row["way"]): row["rmse_r"] for row in measured["errors"]}
    table = [["int8 against fp32", "RMSE of int8 by fp32", "pixels on the same side of r, %"]]
    for row in measured["agreement"]:
        level = row["level"]
        change = rmse[level, SHIPPED] / rmse[level, FLOAT] - 1
        table.append([SAYS[level], f"{change:+.1%}", f"{100 * row['same_side']:.2f}"])
    return table


def noise_rows(rows: list[dict]) -> list[list[str]]:
    table = [["sensor, shipped network", *heads()]]
    return table + [[row["level"], *cells(row)] for row in rows if row["way"] == SHIPPED]


def set_parts(sets: dict) -> list:
    if not sets:
        return []
    table = [["other views, shipped network", *heads()]]
    for name, rows in sets.items():
        table += [[f"{name}, {row['level']}", *cells(row)] for row in rows]
    return [table, "The same thresholds on further sets of views."]


def sheet_parts(name: str) -> list:
    caption = ("Test views, the network's input, and fields: bright at edges, black for unknown depth, grey without a "
               "label. Below each field is its RMSE.")  # fmt: skip
    return [(name, caption)] if name else []


def group_parts(rows: list[dict]) -> list:
    if not rows:
        return []
    table = [["pixels by", "", "depth", "pixels", *heads()]]
    order = list(dict.fromkeys(row["axis"] for row in rows))
    for row in sorted(rows, key=lambda row: order.index(row["axis"])):
        table.append([row["axis"], row["group"], row["level"], f"{row['pixels']:,}", *cells(row)])
    return [("edges-groups.png", "The shipped network by group of pixels."), table]


def speed_parts(rows: list[dict]) -> list:
    front = [row["setting"] for row in front_of(rows)]
    table = [
        ["frames of 640 x 480, reduced to", "ms", "p90", *(f"{SAYS[level]}, r" for level in LEVELS), "mean, r", ""]
    ]
    for row in sorted(rows, key=lambda row: row["ms"]):
        table.append([row["setting"], f"{row['ms']:.1f}", f"{row['ms_p90']:.1f}",
                      *(f"{row['by_level'][level]:.2f}" for level in LEVELS), f"{row['rmse_r']:.2f}",
                      "front" if row["setting"] in front else ""])  # fmt: skip
    caption = "Error against run time of frames of 640 x 480: fields of reduced frames are brought back to full size."
    return [("edges-error-against-run-time.png", caption), table,
            f"RMSE in r of the full frame. No other is faster and better: {'; '.join(front)}."]  # fmt: skip


def saving_rows(rows: list[dict]) -> list[list[str]]:
    table = [["scene, depth, option", "ms without", "ms with", "by it", "network on", "differs by, r", "other side, %"]]
    for row in rows:
        table.append([f"{SCENES[row['scene']]}, {row['noise']}, {row['option']}", f"{row['ms_without']:.2f}",
                      f"{row['ms']:.2f}", f"{row['ms'] / row['ms_without']:.2f}", f"{row['network_fraction']:.0%}",
                      f"{row['difference_r']:.2f}", f"{100 * row['other_side']:.2f}"])  # fmt: skip
    return table


CURVE_COLUMNS = {"precision": ("precision", ".3f"), "recall": ("recall", ".3f"), "f_score": ("F", ".3f"),
                 "chamfer_r": ("Chamfer, r", ".1f"), "hausdorff_r": ("Hausdorff, r", ".1f"),
                 "angle_deg": ("angle of lines, deg", ".2f")}  # fmt: skip


def curve_cells(row: dict) -> list[str]:
    return ["" if row[key] is None else format(row[key], form) for key, (_, form) in CURVE_COLUMNS.items()]


def curve_heads() -> list[str]:
    return [head for head, _ in CURVE_COLUMNS.values()]


def scene_rows(rows: list[dict]) -> list[list[str]]:
    table = [
        ["simulated camera, planes skipped", *curve_heads(), "field, ms", "curves, ms", "boxes, ms", "frames a second"]
    ]
    for row in rows:
        times = [f"{row[key]:.2f}" for key in ("field_ms", "curves_ms", "boxes_ms")]
        table.append([f"{SCENES[row['scene']]}, {row['noise']}", *curve_cells(row), *times, f"{1000 / row['ms']:.0f}"])
    return table


def curve_parts(measured: dict) -> list:
    solids = [["curves, 320 x 240", "views", *curve_heads(), "curves, ms"]]
    for row in measured["curves_of_true_fields"]:
        solids.append([f"true field, {SAYS[row['level']]}", str(row["views"]), *curve_cells(row), ""])
    for row in measured["curves"]:
        solids.append([f"{SAYS[row['level']]}: {row['way']}", str(row["views"]), *curve_cells(row), f"{row['ms']:.2f}"])
    boxes = [["box of 15 to 60 cm at 1.2 to 1.6 m", "frames", "with a box, %", "error of a side, mm (median)", "p90",
              "standard deviation while the camera turns, mm", "frames with a box"]]  # fmt: skip
    for row in measured["boxes"]:
        mm = ["" if row[key] is None else f"{row[key]:.1f}" for key in ("median_mm", "p90_mm", "deviation_mm")]
        boxes.append([f"{row['noise']}: {row['way']}", str(row["frames"]), f"{100 * row['with_box']:.0f}", *mm,
                      f"{row['steady_frames']} of {row['turned_frames']}"])  # fmt: skip
    return [
        solids,
        "By length: precision of what is found within 2 r of a true curve, recall of true curves within 2 r of a found "
        "one, means over views. Roundings that are neither sharp nor smooth count neither for nor against. Distances "
        "end at 100 r.",
        boxes,
        "The largest box of a frame with the sides of the true box, both sorted by size; frames without a box have no "
        "error and are in the percentage alone.",
    ]
