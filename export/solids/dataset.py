"""Renders solids with their labels.

    python -m export.solids.dataset train --count 64000 --processes 2 --out .data/solids/train
    python -m export.solids.dataset test --whole --count 200 --processes 2 --out .data/solids/test

Each solid is a function of (split, seed) alone, and each shard of the seeds in it; a shard appears atomically, what is
there already is kept, so a stopped run goes on where it was. A solid that fails is said and left out; nothing else
changes its number by that.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from tqdm import tqdm

from export.jobs import Work, Workers
from export.solids.crops import CROPS_OF_VIEW, VIEWS, crops_of, whole_views_of
from export.solids.recipe import SPLITS, without_crashes
from export.solids.records import Record, write_shard

VERSION = "solids-4"
SEEDS_OF_SHARD = 100
MAX_S = 600.0  # of a solid, which takes a second; `recipe.CPU_S` comes first


def _crops(job: tuple[str, int], views: int, of_view: int) -> list[Record]:
    return without_crashes(partial(crops_of, *job, views=views, of_view=of_view))


def _whole_views(job: tuple[str, int]) -> list[Record]:
    return without_crashes(partial(whole_views_of, *job))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("split", choices=SPLITS)
    parser.add_argument("--whole", action="store_true", help="whole views with their curves instead of crops")
    parser.add_argument(
        "--count", type=int, default=64000, help="crops, or solids of whole views (default %(default)s)"
    )
    parser.add_argument("--views", type=int, default=VIEWS, help="of a solid to take crops from (default %(default)s)")
    parser.add_argument("--crops-of-view", type=int, default=CROPS_OF_VIEW, help="default: %(default)s")
    parser.add_argument("--out", type=Path, required=True)
    Workers.add_arguments(parser)
    options = parser.parse_args()
    if min(options.count, options.views, options.crops_of_view) < 1:
        parser.error("--count, --views and --crops-of-view must be at least 1")
    options.out.mkdir(parents=True, exist_ok=True)
    seeds = options.count if options.whole else -(-options.count // (options.views * options.crops_of_view))
    shards = {
        options.out / f"solids-{k:05d}.npz": range(k * SEEDS_OF_SHARD, min((k + 1) * SEEDS_OF_SHARD, seeds))
        for k in range(-(-seeds // SEEDS_OF_SHARD))
    }
    missing = {path: own for path, own in shards.items() if not path.exists()}
    crops = partial(_crops, views=options.views, of_view=options.crops_of_view)
    work = _whole_views if options.whole else crops
    _render(options.split, work, missing, Workers.of(options, MAX_S), seeds)


def _render(split: str, work: Work, shards: dict[Path, range], workers: Workers, total: int) -> None:
    path_of = {seed: path for path, seeds in shards.items() for seed in seeds}
    waiting: dict[Path, dict[int, list[Record]]] = {path: {} for path in shards}
    lost: dict[Path, list[int]] = {path: [] for path in shards}
    jobs = [(split, seed) for seed in path_of]
    with tqdm(total=total, initial=total - len(jobs), unit="solid", smoothing=0.05) as bar:
        for done in workers.run(work, jobs):
            bar.update()
            seed = done.job[1]
            path = path_of[seed]
            if done.error is not None:
                tqdm.write(f"{split} {seed} is left out: {done.error}")
                lost[path].append(seed)
            waiting[path][seed] = done.value or []
            if len(waiting[path]) == len(shards[path]):
                own = waiting.pop(path)
                records = [record for number in sorted(own) for record in own[number]]
                write_shard(path, records, {"generator": VERSION, "split": split, "left_out": sorted(lost[path])})


if __name__ == "__main__":
    main()
