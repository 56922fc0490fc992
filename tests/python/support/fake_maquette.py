"""Stands in for `maquette scene` and `maquette bench`: what benchmarks.scenes.command reads, photos made worse.

Pictures are the held-out photos themselves plus noise, as much as the options deserve; times follow from points and
pixels. `install` writes it as a program. What is in `refused` is an option that it does not know.
"""

import argparse
import json
import sys
from pathlib import Path

import cv2
import numpy as np


def install(folder: Path, refused: tuple[str, ...] = ()) -> Path:
    program = folder / "maquette"
    here = str(Path(__file__).parent)
    program.write_text(
        f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {here!r})\nfrom fake_maquette import main\n"
        f"main(sys.argv[1:], {refused!r})\n"
    )
    program.chmod(0o755)
    return program


def cloud_points(capture: Path) -> int:
    table = json.loads((capture / "transforms.json").read_text())
    head = (capture / table.get("ply_file_path", "cloud.ply")).read_bytes()[:400].decode("ascii", "replace")
    return int(head.split("element vertex ")[1].split()[0])


def build(options: argparse.Namespace) -> dict:
    cloud = min(options.points, cloud_points(options.first))
    points = cloud - cloud % 100  # the rest is seen by nobody
    view_dependent = 0 if options.min_variation > 1e6 else points if options.min_variation == 0 else points // 2
    each = 6 + 8 * options.coefficients // 8
    size = points * each + view_dependent * 48 * options.coefficients // 8
    noise = 0.02 + 0.01 * (view_dependent == 0) + 0.002 * (options.coefficients == 8) + 20 / points
    said = {"cloud_points": cloud, "points": points, "view_dependent_points": view_dependent, "bytes": size,
            "seconds": {"total": 0.1, "extract": 0.08}, "peak_memory_mib": 100 + points / 1e4}  # fmt: skip
    options.out.write_text(json.dumps(said | {"noise": noise, "networks": options.bundle.name}))
    return said


def render(options: argparse.Namespace) -> dict:
    scene = json.loads(options.first.read_text())
    table = json.loads((options.capture / "transforms.json").read_text())
    frames = [frame["file_path"] for frame in table["frames"]]
    groups = {"all": frames, "held-out": table.get("test_filenames", [])}
    names = groups.get(options.views, options.views.split(","))
    options.out.mkdir(exist_ok=True)
    rng, views = np.random.default_rng(0), []
    for name in names:
        image = cv2.imread(str(options.capture / name)).astype(np.float32)
        width, height = map(int, options.size.split("x")) if options.size else image.shape[1::-1]
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
        image += rng.normal(0, 255 * scene["noise"], image.shape)
        cv2.imwrite(str(options.out / f"{Path(name).stem}.png"), np.clip(np.rint(image), 0, 255))
        ms = {"project": scene["points"] / 1e5, "shade": 1.0, "refine": width * height / 3e4 / options.threads,
              "resample": 0.5 + 0.25 * ("tiles" in options.without)}  # fmt: skip
        views.append({"name": name, "ms": ms | {"total": sum(ms.values())}})
    return {"views": views}


def main(words: list[str], refused: tuple[str, ...]) -> None:
    if words[0] == "bench":
        machine = {"processor": "fake", "cores": 2, "memory_mib": 2048, "system": "S", "architecture": "x86_64",
                   "instruction_sets": ["avx2"]}  # fmt: skip
        Path(words[words.index("--json") + 1]).write_text(json.dumps({"machine": machine, "bundle": "b"}))
        return
    parser = argparse.ArgumentParser()
    parser.add_argument("command", choices=("build", "render", "info"))
    parser.add_argument("first", type=Path)
    for name in ("--out", "--bundle", "--json", "--capture"):
        parser.add_argument(name, type=Path)
    for name, value in (("--points", 10**9), ("--views", None), ("--long-side", 640), ("--coefficients", 8),
                        ("--min-variation", 0.01), ("--size", None), ("--repeat", 1), ("--threads", 2)):  # fmt: skip
        if name not in refused:
            parser.add_argument(name, type=type(value) if value is not None else str, default=value)
    if "--without" not in refused:
        parser.add_argument("--without", default="")
    parser.add_argument("--no-alpha", action="store_true")
    options = parser.parse_args(words[1:])
    for name in refused:
        setattr(options, name.strip("-"), {"--threads": 2}.get(name, ""))
    said = {"build": build, "render": render}.get(options.command, lambda o: json.loads(o.first.read_text()))(options)
    options.json.write_text(json.dumps(said))
