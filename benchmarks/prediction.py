"""Measures predicted frames of clips: PSNR and SSIM by frames ahead beside the last frame and OpenCV's DIS, the error
of the estimated motion, run times, waits and PSNR of a concealer, and the time of camera health.

    python -m benchmarks.prediction                         a table, build/benchmarks/prediction.json (14 minutes)
    python -m benchmarks.prediction --quick                 fewer clips, a smoke test
    python -m benchmarks --only prediction                  the same as a section of the report

Needs clips of `export.clips` (.data/clips/pushing/val) and of `export.photos` (.data/photos/clip), and the programs
measure_prediction and find_motion (`cmake --build --preset release --target measure_prediction find_motion`). The
report names clips that are missing. Predictions begin at every third frame; all methods see the same frames.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import maquette
import numpy as np
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from benchmarks import concealment, sampling
from benchmarks.concealment import FIRST_START, START_STEP, psnr_db
from benchmarks.prediction_quality import motion_error
from benchmarks.prediction_quality.dis import Dis
from benchmarks.prediction_quality.structure import structure_of
from benchmarks.sampling.tables import sampling_tables
from export.clips.clip import read_clip

PROGRAM = Path("build/release/benchmarks/native/measure_prediction")
HORIZONS = (1, 3, 5, 8)  # frames ahead
BUNDLE = Path("sdk/models/prediction-int8")
SIZE_PX, LARGE_PX = (320, 240), (640, 480)
FRAMES = 90  # frames of a real clip
WAIT_SOURCE = "stub:people?count=2&size=640x480&fps=30&drop=0.25&fault_seed=5"
METRICS = (
    "prediction_frames_a_second", "concealed_wait_p99_ms", "camera_health_frames_a_second", *concealment.METRICS,
    *sampling.METRICS,
)  # fmt: skip
METHODS = {"last": "last frame", "motion": "motion", "dis": "OpenCV DIS", "auto": "auto"}


@dataclass(frozen=True)
class Film:
    """A clip: name, and bgr: uint8 [T, H, W, 3] at `fps` frames a second."""

    name: str
    bgr: np.ndarray
    fps: float


def measure(
    quick: bool = False,
    clips: Path = Path(".data/clips/pushing/val"),
    photos: Path = Path(".data/photos/clip"),
    threads: int = 2,
) -> tuple[dict, dict[str, float], dict[str, str]]:
    """Returns the document, the metrics of METRICS, and why others are missing.

    Raises FileNotFoundError where the program was not built, subprocess.SubprocessError where it fails.
    """
    if not PROGRAM.exists():
        raise FileNotFoundError(f"{PROGRAM} is missing: cmake --build --preset release --target measure_prediction")
    absent = []
    films = real_films(photos, SIZE_PX, quick)
    if not films:
        absent.append(f"real clips ({photos} has none: python -m export.photos people)")
    pushing = clip_films(clips, 3 if quick else 24)
    if not pushing:
        absent.append(f"pushing ({clips} has none: python -m export.clips.dataset pushing --split val --clips 16)")
    rows = [
        measure_film(film, threads, has_ssim=True) for film in tqdm([*films, *pushing], desc="prediction", disable=None)
    ]
    large = [film for film in real_films(photos, LARGE_PX, quick=True) if film.bgr.shape[1:3] == LARGE_PX[::-1]]
    speed = [measure_film(film, count) for film in large[:1] for count in (1, threads)]
    waits = json.loads(run(["waits", "6" if quick else "30", WAIT_SOURCE]))
    document = {"rows": rows, "sets": means_of(rows), "speed": speed, "waits": waits, "missing": absent, "warnings": []}
    if pushing:
        paths = sorted(clips.glob("clip-*.npz"))[: 3 if quick else 24]
        document["motion_error_px"] = motion_error.measure(paths)
    document["health"] = frames_a_second(60 if quick else 200)
    metrics = {
        "concealed_wait_p99_ms": waits["wait_ms"]["p99"],
        "camera_health_frames_a_second": document["health"]["frames_a_second"],
    }
    missing = {}
    if speed:
        metrics["prediction_frames_a_second"] = 1000 / (speed[-1]["push_ms"] + speed[-1]["predict_ms"])
    else:
        missing["prediction_frames_a_second"] = "; ".join(absent)
    bridged = concealment.measure(films, threads)
    document["concealment"] = {name: rows.tolist() for name, rows in bridged.items()}
    if bridged:
        metrics |= concealment.metrics_of(bridged)
    else:
        missing |= dict.fromkeys(concealment.METRICS, "; ".join(absent))
    if pushing:
        document["sampling"], found = measure_sampling(quick, clips, threads)
        metrics |= found
    else:
        missing |= dict.fromkeys(sampling.METRICS, "; ".join(absent))
    return document, metrics, missing


def measure_sampling(quick: bool, folder: Path, threads: int) -> tuple[dict, dict[str, float]]:
    """Returns the document and its metrics for the validation clips of a folder DATA/SET/val."""
    from benchmarks.sampling import measure  # torch is imported late, since it loads slowly

    data, kind = folder.parent.parent, folder.parent.name
    clips = measure.clips_of(data, kind, 2 if quick else None)
    document, metrics = measure.measure_images(clips, measure.real_clips(data, kind, len(clips)), BUNDLE)
    document["times_ms"], of_times = measure.measure_times(clips, BUNDLE, threads)
    return document, metrics | of_times


def run(words: Sequence[str], given: bytes = b"") -> str:
    return subprocess.run([str(PROGRAM), *words], input=given, capture_output=True, check=True).stdout.decode()


def real_films(folder: Path, size_px: tuple[int, int], quick: bool) -> list[Film]:
    films = []
    for path in sorted(folder.glob("*.*")):
        capture = cv2.VideoCapture(str(path))
        own_fps = capture.get(cv2.CAP_PROP_FPS)
        for wanted_fps in (10,) if quick else (10, 30):
            step = max(1, round(own_fps / wanted_fps))
            fps = own_fps / step
            if abs(fps / wanted_fps - 1) > 0.3:
                continue
            frames = read_film(path, step, size_px)
            if len(frames) > FIRST_START + max(HORIZONS):
                films.append(Film(f"{path.stem}, {fps:.0f} fps", np.stack(frames), fps))
    return films


def read_film(path: Path, step: int, size_px: tuple[int, int], most: int = FRAMES) -> list[np.ndarray]:
    """Reads every `step`-th frame of a file, BGR uint8, at most `most`."""
    capture, frames, index = cv2.VideoCapture(str(path)), [], 0
    while len(frames) < most:
        there, frame = capture.read()
        if not there:
            break
        if index % step == 0:
            frames.append(cv2.resize(frame, size_px, interpolation=cv2.INTER_AREA))
        index += 1
    return frames


def clip_films(folder: Path, most: int) -> list[Film]:
    """Reads at most `most` clips of a folder DATA/SET/SPLIT that have frames of 320 x 240."""
    films = []
    for path in sorted(folder.glob("clip-*.npz"))[:most]:
        clip = read_clip(path)
        if clip.large is not None:
            films.append(
                Film(f"{folder.parent.name} {path.stem[5:]}, {clip.fps:.0f} fps", clip.large.rgb[..., ::-1], clip.fps)
            )
    return films


def measure_film(film: Film, threads: int, has_ssim: bool = False) -> dict:
    frames = np.ascontiguousarray(film.bgr)
    height, width = frames.shape[1:3]
    words = ["errors", str(width), str(height), str(film.fps), str(threads), *map(str, HORIZONS)]
    found = json.loads(run(words, frames.tobytes()))
    dis, dis_ms = dis_errors(frames)
    for row in found["horizons"]:
        row["dis_db"] = dis[row["frames"]]
    if has_ssim:
        for name, values in structure_of(frames, film.fps, HORIZONS, threads).items():
            for row, value in zip(found["horizons"], values, strict=True):
                row[f"{name}_ssim"] = value
    return {"film": film.name, "size_px": [width, height], "threads": threads, "dis_ms": dis_ms, **found}


def dis_errors(frames: np.ndarray) -> tuple[dict[int, float], float]:
    """Extrapolates by OpenCV's DIS (preset medium) at constant velocity, warped backward. Returns PSNR by horizon, and
    milliseconds for the motion and one image on OpenCV's own threads."""
    dis = Dis(*frames.shape[1:3])
    errors: dict[int, list[float]] = {horizon: [] for horizon in HORIZONS}
    times = []
    for start in range(FIRST_START, len(frames) - max(HORIZONS), START_STEP):
        begin = time.perf_counter()
        to_before = dis.motion(frames[start], frames[start - 1])
        for horizon in HORIZONS:
            moved = dis.moved(frames[start], to_before, horizon)
            if horizon == HORIZONS[0]:
                times.append(1000 * (time.perf_counter() - begin))
            errors[horizon].append(psnr_db(moved, frames[start + horizon]))
    return {horizon: float(np.mean(values)) for horizon, values in errors.items()}, float(np.median(times))


def frames_a_second(frames: int = 200) -> dict[str, float]:
    """Measures camera health of a simulated camera of 640 x 480: median wall-clock and processor time."""
    health = maquette.CameraHealth()
    push_ms, used_ms = [], []
    for frame in maquette.Source(f"stub:people?count=2&size=640x480&fps=30&frames={frames}"):
        begin = time.process_time()
        health.push(frame)
        used_ms.append(1000 * (time.process_time() - begin))
        push_ms.append(health.stats["push_ms"])
    median_ms = float(np.median(push_ms[5:]))
    return {"frames_a_second": 1000 / median_ms, "push_ms": median_ms, "cpu_ms": float(np.median(used_ms[5:]))}


def means_of(rows: list[dict]) -> dict[str, dict]:
    """Returns PSNR and SSIM by method and horizon, means over the clips of pushing and over the real clips."""
    sets = {"pushing": [row for row in rows if row["film"].startswith("pushing")],
            "real": [row for row in rows if not row["film"].startswith("pushing")]}  # fmt: skip
    return {
        name: {"clips": len(of_set),
               **{method: mean_by_horizon(of_set, f"{method}_db") for method in METHODS},
               "ssim": {method: mean_by_horizon(of_set, f"{method}_ssim") for method in METHODS
                        if f"{method}_ssim" in of_set[0]["horizons"][0]}}
        for name, of_set in sets.items() if of_set
    }  # fmt: skip


def mean_by_horizon(rows: list[dict], key: str) -> list[float]:
    return [float(np.mean([row["horizons"][i][key] for row in rows])) for i in range(len(HORIZONS))]


def methods_in(sets: dict[str, dict]) -> list[str]:
    """Returns the methods that all sets have; an older document has fewer."""
    return [method for method in METHODS if all(method in means for means in sets.values())]


def ssim_table(sets: dict[str, dict]) -> list[list[str]]:
    """Returns a header and a row for each set: SSIM by method and frames ahead. Sets without SSIM are left out."""
    methods = methods_in(sets)
    table = [["clips, SSIM", *(f"{METHODS[name]} +{horizon}" for horizon in HORIZONS for name in methods)]]
    for name, means in sets.items():
        if means.get("ssim"):
            cells = [f"{means['ssim'][method][i]:.3f}" for i in range(len(HORIZONS)) for method in methods]
            table.append([f"mean of {means['clips']} ({name})", *cells])
    return table


def table_of(rows: list[dict], sets: dict[str, dict]) -> list[list[str]]:
    """Returns a header and a row for each clip and set: PSNR in dB by method and frames ahead, and the weight of motion
    in AUTO."""
    methods = methods_in(sets)
    table = [["clip", *(f"{METHODS[name]} +{ahead}" for ahead in HORIZONS for name in methods), "motion in auto"]]
    for row in rows:
        cells = [f"{ahead[f'{method}_db']:.1f}" for ahead in row["horizons"] for method in methods]
        taken = "/".join(f"{ahead['motion_fraction']:.0%}" for ahead in row["horizons"])
        table.append([row["film"], *cells, taken])
    for name, means in sets.items():
        cells = [f"{means[method][i]:.1f}" for i in range(len(HORIZONS)) for method in methods]
        table.append([f"mean of {means['clips']} ({name})", *cells, ""])
    return table


def section(measured: dict) -> tuple[str, list]:
    """Returns the title and the parts of the section, from a document of `measure`."""
    waits = measured["waits"]
    parts: list = [
        "Frames predicted 1, 3, 5 and 8 frames after the latest frame: PSNR in dB (320 x 240). Motion: our optical "
        "flow. OpenCV DIS: constant velocity by its preset medium. auto: the default of an app.",
        table_of([], measured["sets"]) if measured["sets"] else "There were no clips.",
    ]
    structure = ssim_table(measured["sets"])
    parts += [structure] if len(structure) > 1 else []
    errors = measured.get("motion_error_px", {})  # an older document has none
    if "motion" in errors:
        parts.append(
            f"Motion from frame to frame of {errors['clips']} clips of pushing, where objects move (by "
            f"{motion_error.MIN_MOTION_PX} pixels and more) and stay visible. Endpoint error in pixels of 320 x 240, "
            "mean and median of a clip: "
            + ", ".join(f"{says} {errors[name][0]:.2f} and {errors[name][1]:.2f}"
                        for name, says in motion_error.METHODS.items())
            + "."
        )  # fmt: skip
    rows = [
        [
            "640 x 480, ms",
            "threads",
            "frame pushed",
            "with auto",
            "frame predicted",
            "frames a second",
            "CPU time",
            "DIS, its threads",
        ]
    ]
    for row in measured["speed"]:
        rate = 1000 / (row["push_ms"] + row["predict_ms"])
        times = [f"{row[key]:.2f}" for key in ("push_ms", "auto_push_ms", "predict_ms")]
        rows.append(
            [row["film"], str(row["threads"]), *times, f"{rate:.0f}", f"{row['cpu_ms']:.1f}", f"{row['dis_ms']:.1f}"]
        )
    parts += [rows] if measured["speed"] else []
    parts.append(
        "A concealer for a camera of 640 x 480 at 30 frames a second that drops a quarter of its frames: "
        f"{waits['captured']} frames captured, {waits['predicted']} predicted, ready "
        f"{waits['wait_ms']['median']:.2f} ms (median), {waits['wait_ms']['p99']:.2f} ms (p99) after they were due."
    )
    if measured.get("concealment"):  # an older document has none
        parts.append(
            "Concealed gaps of up to 300 ms, PSNR in dB over their frames: last frame repeated / predicted frames."
        )
        parts.append(concealment.table_of({name: np.array(rows) for name, rows in measured["concealment"].items()}))
    if "health" in measured:  # an older document has none
        health = measured["health"]
        parts.append(
            f"Camera health, frames of 640 x 480: {health['frames_a_second']:.0f} a second, {health['push_ms']:.1f} ms "
            f"and {health['cpu_ms']:.1f} ms of processor time a frame."
        )
    if measured.get("sampling"):
        parts += sampling_tables(measured["sampling"])
    parts += [f"Not measured: {'; '.join(measured['missing'])}."] if measured["missing"] else []
    return "Prediction", parts


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.prediction",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--clips", type=Path, default=Path(".data/clips/pushing/val"), metavar="DIR")
    parser.add_argument("--photos", type=Path, default=Path(".data/photos/clip"), metavar="DIR")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks/prediction.json"), metavar="FILE")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args(argv)
    document, metrics, missing = measure(options.quick, options.clips, options.photos, options.threads)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(json.dumps(document | {"metrics": metrics}, indent=1) + "\n")
    console = Console(width=200)
    head, *rows = table_of(document["rows"], document["sets"])
    shown = Table(*head)
    for row in rows:
        shown.add_row(*row)
    console.print(shown)
    for part in section(document)[1][2:]:
        console.print(part if isinstance(part, str) else "\n".join("   ".join(row) for row in part))
    for name in METRICS:
        console.print(f"{name}: {metrics[name]:.2f}" if name in metrics else f"{name}: not measured, {missing[name]}")
    console.print(f"Written: {options.out}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
