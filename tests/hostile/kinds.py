"""The kinds of hostile input: what makes a trial of each, and how many the whole run has."""

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from tests.hostile import arguments, bundles, captures, head_files, limits, paths, pictures, recordings, scene_files
from tests.hostile.samples import Samples
from tests.hostile.trial import Trial


@dataclass(frozen=True)
class Kind:
    """make: (samples, rng, index) to a trial. count: of the whole run. needs: "user" where the run has to begin with
    the rights of root, "limits" where sanitizers cannot live with it."""

    make: Callable[[Samples, Random, int], Trial]
    count: int
    needs: tuple[str, ...] = ()


KINDS = {
    "bundle-files": Kind(bundles.damaged_files, 300),
    "bundle-exchanged": Kind(bundles.exchanged_files, 60),
    "bundle-unsigned": Kind(bundles.unsigned_files, 60),
    "manifests": Kind(bundles.manifests, 450),
    "capture-transforms": Kind(captures.transforms, 150),
    "capture-clouds": Kind(captures.clouds, 120),
    "capture-photos": Kind(captures.photos, 40),
    "capture-colmap": Kind(captures.colmap, 120),
    "scene-unchecked": Kind(scene_files.unchecked, 120),
    "scene-checked": Kind(scene_files.checked, 180),
    "scene-sections": Kind(scene_files.sections, 60),
    "head-unchecked": Kind(head_files.unchecked, 120),
    "head-checked": Kind(head_files.checked, 180),
    "recording-unchecked": Kind(recordings.unchecked, 90),
    "recording-heads": Kind(recordings.heads, 90),
    "recording-frames": Kind(recordings.frames, 120),
    "recording-indices": Kind(recordings.indices, 60),
    "images": Kind(pictures.images, 240),
    "image-kinds": Kind(pictures.other_kinds, 36),
    "image-sizes": Kind(pictures.sizes, 120),
    "clips": Kind(pictures.clips, 90),
    "uris": Kind(arguments.uris, 200),
    "options": Kind(arguments.options, 320),
    "wrong-uses": Kind(arguments.wrong_uses, 42),
    "environment": Kind(arguments.environment, 60),
    "special-inputs": Kind(paths.inputs, 256, ("user",)),
    "special-outputs": Kind(paths.outputs, 136, ("user",)),
    "names": Kind(paths.names, 68),
    "written-names": Kind(paths.written_names, 60),
    "memory": Kind(limits.memory, 288, ("user", "limits")),
    "threads": Kind(limits.threads, 96, ("user", "limits")),
    "open-files": Kind(limits.files, 128),
    "file-sizes": Kind(limits.file_sizes, 96),
    "lost-output": Kind(limits.lost_output, 128),
    "signals": Kind(limits.signals, 120),
}


def trials(samples: Samples, seed: int, only: list[str], count: int | None) -> list[tuple[str, Trial]]:
    """Kinds and trials; the same for the same seed, whatever else is asked for. count: at most so many of each kind,
    spread over what the whole run has of it."""
    made = []
    for name in only:
        kind = KINDS[name]
        chosen = range(kind.count)
        if count is not None and count < kind.count:
            chosen = [kind.count * k // count for k in range(count)]
        made += [(name, kind.make(samples, Random(f"{seed}/{name}/{index}"), index)) for index in chosen]
    return made
