"""Measures dense pose: trained networks, exported ones and the SDK in one table.

On rendered images with exact labels, and on real photographs if the teachers have labelled them (export.teachers).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from maquette import MaquetteError

from export.evaluation import photos, report
from export.evaluation.backends import fingerprint, open_backend
from export.evaluation.measure import Metrics, image_ranges, measure
from export.evaluation.plot import write_image
from export.jobs import Workers
from export.shards import count_images, shard_paths

EPILOG = """\
backends, each `kind` or `kind=path`, separated by commas:
  torch   a checkpoint of export.densepose     onnx   a bundle, run by ONNX Runtime in Python
  capi    a bundle, run by libmaquette through its C API (build the SDK first: make build)

examples:
  python -m export.evaluation --limit 100
  python -m export.evaluation --data .data/people/val --backends torch=.data/runs/b/weights.pt
  python -m export.evaluation --backends onnx,capi=.data/bundles/densepose-b-fp32,capi

metrics:
  box AP            COCO average precision of the boxes, at IoU .50 and averaged over .50:.05:.95
  GPS AP            the same with geodesic point similarity on the body surface (kappa 0.255 m,
                    196 pixels a person)
  GPSm AP           the same with sqrt(GPS * mask IoU)
  recall, precision fraction of the people found, fraction of the shown boxes that are right, at IoU .50
  part accuracy     fraction of all people's visible pixels painted with the right one of 24 parts;
                    missed people count
  left/right        of the limb pixels painted as a limb, those with the right side
  mask IoU          person pixels, all images together; in groups the mean over people
  median |dU| |dV|  where the part is right
  surface error     median geodesic distance of the painted point from the true one
  calibration error mean gap between score and fraction of right boxes, over ten bins of score
real photographs: python -m export.evaluation.photos --help
"""


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m export.evaluation", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument(
        "--data", type=Path, default=Path(".data/people/test"), metavar="DIR",
        help="folder of shards with surface points (default: .data/people/test)",
    )  # fmt: skip
    photos.add_arguments(parser)
    parser.add_argument("--backends", default="torch,onnx,capi", help="default: torch,onnx,capi")
    parser.add_argument("--limit", type=int, metavar="N", help="only the first N rendered images")
    parser.add_argument(
        "--score-floor", type=float, default=0.05, metavar="S",
        help="lowest score that enters AP (default 0.05)",
    )  # fmt: skip
    parser.add_argument(
        "--roll", type=float, metavar="DEGREES",
        help="turn rendered images by so much, on a square that holds any turn; compare with --roll 0",
    )  # fmt: skip
    Workers.add_arguments(parser, processes=0)
    parser.add_argument(
        "--out", type=Path, default=Path("build/evaluation"), metavar="DIR",
        help="for evaluation.json and evaluation.png (default: build/evaluation)",
    )  # fmt: skip
    arguments = parser.parse_args(argv)
    try:
        return run(arguments)
    except (MaquetteError, OSError, RuntimeError, ValueError) as error:
        print(f"Evaluation stopped: {error}", file=sys.stderr)
        return 1


def run(arguments: argparse.Namespace) -> int:
    from export.people.atlas import load_surface_table

    paths = shard_paths(arguments.data)
    total = count_images(paths)
    total = total if arguments.limit is None else min(total, arguments.limit)
    texts = arguments.backends.split(",")
    backends = [open_backend(text, arguments.score_floor) for text in texts]
    table = load_surface_table()
    photo_set = photos.PhotoSet.find(arguments.photos, arguments.labels, arguments.empty, arguments.animals)
    results: dict[str, Metrics] = {}
    photo_results: dict[str, photos.PhotoMetrics] = {}
    sources: dict[str, tuple[Path, str]] = {}
    for text, backend in zip(texts, backends, strict=True):
        name = report.column_name(backend.kind, backend.precision)
        if name in results:
            name = f"{name} ({backend.path.name})"
        ranges = image_ranges(text, arguments.score_floor, paths, arguments.limit, arguments.roll)
        results[name] = measure(ranges, table, Workers.of(arguments))
        if photo_set.photos:
            photo_results[name] = photos.measure(backend, photo_set)
        sources[name] = (backend.path, fingerprint(backend.path))
    report.print_table(results)
    if len(results) > 1:
        print(f"Largest difference between columns: {report.largest_difference(results):.2f} points")
    report.print_groups(f"people of the rendered images, {name}", results[name].groups)
    if photo_results:
        photos.print_metrics(f"real photographs, {name}", photo_results[name])
        report.print_groups(f"people of the photographs, {name}", photo_results[name].groups)
    else:
        print(f"No real photographs: {arguments.labels} has no labels (python -m export.teachers makes them).")
    data = {"folder": str(arguments.data), "shards": len(paths), "images": total, "limit": arguments.limit,
            "roll": arguments.roll,
            "score_floor": arguments.score_floor,
            "photos": [str(folder) for folder in arguments.photos],
            "empty": [str(folder) for folder in arguments.empty],
            "animals": [str(folder) for folder in arguments.animals]}  # fmt: skip
    report.write_json(arguments.out / "evaluation.json", results, photo_results, sources, data)
    write_image(arguments.out / "evaluation.png", results, photo_results)
    print(f"Written: {arguments.out / 'evaluation.json'}, {arguments.out / 'evaluation.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
