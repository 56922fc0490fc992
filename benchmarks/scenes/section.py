"""Writes the section "Scenes" of the report."""

from __future__ import annotations

from benchmarks.scenes.command import STAGES
from benchmarks.scenes.speed import memory_a_point

SHIPPED = "as shipped"


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of scenes.measure."""
    rows, speed = measured["rows"], measured["speed"]
    there = [place for place in measured["places"] if "missing" not in place]
    rendered, real = ([place for place in there if place["real"] == is_real] for is_real in (False, True))
    parts: list = [
        "New views of captured scenes, built from their posed photos and point clouds, beside photos that were held "
        f"out: {photos_of(rendered)} of {len(rendered)} rendered scenes that no training saw, {photos_of(real)} of "
        f"{len(real)} real ones."
    ]
    parts += [f"Warnings of the measurement: {'; '.join(measured['warnings'])}."] if measured["warnings"] else []
    if any(row["rendered"] for row in rows):
        parts += [
            (
                "scenes-quality.png",
                "Error against the time to the first image, means over the rendered scenes. Named: baselines without a "
                "network, the scene as shipped, and the Pareto front.",
            ),
            error_rows(rows, "rendered"),
            "First image: time from the capture on disk, with given cameras and cloud, to an image. It covers two "
            "processes of the command line for our scenes, and a started Python process for baselines. Nearest photo: "
            "the source photo with the nearest camera, by the mean motion of the cloud's points in the image. Plain "
            "points: one pixel a point, the nearest in front. Pyramid: pixels without a point show the next coarser "
            "raster. The background of both is the mean colour of photo pixels without a point. PSNR and SSIM (11 x 11 "
            "Gaussian window, sigma 1.5, mean of the three channels) of RGB over all pixels. Distance: relative "
            "difference of features of the person detector's MobileNetV2, averaged over four layers. It is similar to "
            "LPIPS but without human judgement, so its values compare within this report only. Images of half the "
            "size are compared with photos of half the size.",
        ]
    if any(row["real"] for row in rows):
        parts += ["On the real scenes:", error_rows(rows, "real")]
    missing = missing_lines(rows)
    parts += [f"Not measured: {'; '.join(missing)}."] if missing else []
    gain = gain_over(rows, "pyramid of points")
    if gain is not None:
        parts.append(f"The networks gain {gain:+.2f} dB over the pyramid of points, which is the input of the refiner.")
    if measured["sheet"]:
        caption = "Held-out photos and the image of each method from the same camera, with its PSNR."
        parts += [(measured["sheet"], caption), place_rows(there, rows)]
    saved = saving_rows(rows)
    if len(saved) > 1:
        parts += [
            saved,
            "Cost of work that a scene skips: differences to the scene as shipped, means over the rendered scenes. "
            "Error: the PSNR lost by skipping it.",
            f"{unseen_fraction(rows):.0%} of the cloud points are seen by no photo; they have no descriptor and are "
            "not stored.",
        ]
    if speed:
        parts += speed_parts(speed)
    elif measured["speed_missing"]:
        parts.append(f"Time of a frame was not measured: {measured['speed_missing']}.")
    return "Scenes", parts


def gain_over(rows: list[dict], way: str) -> float | None:
    """Returns the gain in dB of the scene as shipped, if both were measured on all rendered captures."""
    found = {row["setting"]: row["rendered"] for row in rows}
    if not found.get(SHIPPED) or not found.get(way):
        return None
    return found[SHIPPED]["psnr_db"] - found[way]["psnr_db"]


def photos_of(places: list[dict]) -> str:
    return f"{sum(place['held_out'] for place in places)} photos"


def _shown(metrics: dict, key: str, form: str, scale: float = 1) -> str:
    return format(scale * metrics[key], form) if key in metrics else ""


def error_rows(rows: list[dict], kind: str) -> list[list[str]]:
    """kind: "rendered" or "real"."""
    table = [["way", "first image, s", "a frame, ms", "PSNR, dB", "SSIM", "distance", "points", "bytes a point"]]
    for row in rows:
        metrics = row[kind]
        if metrics and row["axis"] != "not needed":
            table.append([row["setting"], _shown(metrics, "first_image_s", ".2f"), _shown(metrics, "frame_ms", ".1f"),
                          _shown(metrics, "psnr_db", ".2f"), _shown(metrics, "ssim", ".3f"),
                          _shown(metrics, "distance", ".3f"), _shown(metrics, "points", ",.0f"),
                          _shown(metrics, "bytes_a_point", ".1f")])  # fmt: skip
    return table


def missing_lines(rows: list[dict]) -> list[str]:
    """Returns reasons with their settings; one capture stands for all."""
    by_reason: dict[str, list[str]] = {}
    for row in rows:
        for reason in list(row["missing"].values())[:1]:
            by_reason.setdefault(reason, []).append(row["setting"])
    return [f"{', '.join(names)} ({reason})" for reason, names in by_reason.items()]


def unseen_fraction(rows: list[dict]) -> float:
    """Returns the fraction of cloud points without a descriptor in the rendered captures, as shipped."""
    metrics = next(row["rendered"] for row in rows if row["setting"] == SHIPPED)
    return 1 - metrics["points"] / metrics["cloud_points"]


def place_rows(places: list[dict], rows: list[dict]) -> list[list[str]]:
    """Returns PSNR by capture for the shown methods."""
    ways = [row for row in rows if row["axis"] in ("shipped", "baseline") and row["places"]]
    table = [["scene", "photos", "points of its cloud", *(f"{row['setting']}, dB" for row in ways)]]
    for place in places:
        found = [row["places"].get(place["name"], {}) for row in ways]
        table.append([place["name"] + (", real" if place["real"] else ""), str(place["photos"]),
                      f"{place['points']:,}", *(_shown(metrics, "psnr_db", ".2f") for metrics in found)])  # fmt: skip
    return table


def saving_rows(rows: list[dict]) -> list[list[str]]:
    found = {row["setting"]: row["rendered"] for row in rows}
    table = [["saving", "bytes a point", "a frame, ms", "error, dB"]]
    shipped = found.get(SHIPPED)
    named = [("every descriptor varies", "descriptors that do not vary keep their mean"),
             ("coefficients of 32 bits", "coefficients of few bits")]  # fmt: skip
    for setting, said in named:
        metrics = found.get(setting)
        if shipped and metrics:
            # Bytes relative to the scene as shipped, whose point count may differ.
            less = (shipped["bytes"] - metrics["bytes"]) / shipped["points"]
            table.append([said, _change(less, 1), _change(shipped["frame_ms"] - metrics["frame_ms"], 2),
                          _change(metrics["psnr_db"] - shipped["psnr_db"], 3)])  # fmt: skip
    return table


def _change(value: float, digits: int) -> str:
    return f"{value:+.{digits}f}" if round(value, digits) else "0"


def speed_parts(speed: dict) -> list:
    frames = [["points", "size", "threads", *STAGES, "all, ms", "frames a second"]]
    for row in sorted(speed["frames"], key=lambda r: (r["threads"] != speed["threads"], r["size_px"], r["points"])):
        frames.append([f"{row['points']:,}", f"{row['size_px'][0]} x {row['size_px'][1]}", str(row["threads"]),
                       *(f"{row['ms'][stage]:.1f}" for stage in STAGES), f"{row['ms']['total']:.1f}",
                       f"{1000 / row['ms']['total']:.0f}"])  # fmt: skip
    built = [["points of the cloud", "left in the scene", "modelling, s", "peak memory, MB", "bytes a point"]]
    for row in speed["built"]:
        built.append([f"{row['cloud']:,}", f"{row['points']:,}", f"{row['build_s']:.2f}",
                      f"{row['peak_memory_mb']:.0f}", f"{row['bytes_a_point']:.1f}"])  # fmt: skip
    more = memory_a_point(speed)
    parts = [
        ("scenes-frame-time.png", "Time of a frame against points and pixels, and where it goes."),
        frames,
        f"A view of {speed['place']}, with clouds of its exact depth; medians.",
        built,
        "Modelled from 24 photos of 640 x 480. A point of a cloud that wins no pixel of any photo is dropped."
        + (f" Each point of the cloud adds {more:.0f} bytes to the peak of memory." if more is not None else ""),
    ]
    if speed["missing"]:
        said = "; ".join(f"{what} ({why})" for what, why in speed["missing"].items())
        parts.append(f"Not measured: {said}.")
    return parts
