"""Tracks of clips beside the truth: which boxes count, who is recognised after an absence, changes of the count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import linear_sum_assignment

from benchmarks.people_over_time.detections import Detections
from benchmarks.people_over_time.metrics import MATCH_IOU, Frame, iou_of, matches, scores
from benchmarks.people_over_time.trackers import NO_ID
from export.people.clips.clip_file import Truth
from export.shards import MIN_PIXELS, MIN_SIDE_PX

AWAY_S = 2.0
_MIN_FRACTION = 0.08  # visible pixels as a part of the box of the whole body: about a fifth of the person


def counted(truth: Truth) -> np.ndarray:
    """Which people of which frames must be found, bool [T, P]: large enough, and a fifth of them or more visible."""
    visible, full = truth.visible_box, truth.full_box
    side = np.nan_to_num(visible[..., 2:] - visible[..., :2]).max(-1)
    whole = np.nan_to_num((full[..., 2:] - full[..., :2]).prod(-1))
    return (truth.visible_px >= np.maximum(MIN_PIXELS, _MIN_FRACTION * whole)) & (side >= MIN_SIDE_PX)


def frames_of(truth: Truth, found: Sequence[Detections], ids: Sequence[np.ndarray]) -> list[Frame]:
    """Boxes with an id beside the people that count. Boxes of people who do not count are neither right nor wrong.
    Raises ValueError where the number of frames differs."""
    if len(found) != truth.frames:
        raise ValueError(f"the clip has {truth.frames} frames, but there are detections of {len(found)}")
    must = counted(truth)
    frames = []
    for t, (one, own) in enumerate(zip(found, ids, strict=True)):
        seen = np.flatnonzero(truth.visible_px[t])
        iou = iou_of(truth.visible_box[t, seen], one.boxes)
        rows, columns = linear_sum_assignment(-iou)
        of_ignored = np.zeros(len(one.boxes), bool)
        good = iou[rows, columns] >= MATCH_IOU
        of_ignored[columns[good]] = ~must[t, seen[rows[good]]]
        free = np.setdiff1d(np.arange(len(one.boxes)), columns[good])
        ignored = truth.visible_box[t, seen[~must[t, seen]]]
        of_ignored[free] = _inside(one.boxes[free], ignored).any(1)
        kept = ~of_ignored & (own != NO_ID)
        people = np.flatnonzero(must[t])
        frames.append(Frame(people, own[kept], iou_of(truth.visible_box[t, people], one.boxes[kept])))
    return frames


def _inside(boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether half of a box [N, 4] or more is within another [M, 4]: [N, M]."""
    sides = np.minimum(boxes[:, None, 2:], others[None, :, 2:]) - np.maximum(boxes[:, None, :2], others[None, :, :2])
    area = np.maximum((boxes[:, 2:] - boxes[:, :2]).prod(1), 1e-9)
    return np.clip(sides, 0, None).prod(-1) >= 0.5 * area[:, None]


@dataclass(frozen=True)
class Return:
    """A person who comes back after AWAY_S or more out of view. before, after: the id that the person mostly has until
    the next absence; None where no box matches. others: main ids of other people until then."""

    before: int | None
    after: int | None
    others: frozenset[int]

    @property
    def is_recognised(self) -> bool:
        return self.before is not None and self.before == self.after


def returns(truth: Truth, frames: Sequence[Frame]) -> list[Return]:
    times = truth.time_ns / 1e9
    own: dict[int, dict[int, int]] = {p: {} for p in range(truth.people)}
    for t, (f, (rows, columns)) in enumerate(zip(frames, matches(frames), strict=True)):
        for person, track in zip(f.true_ids[rows].tolist(), f.ids[columns].tolist(), strict=True):
            own[person][t] = track

    def mainly(person: int, first: int, last: int) -> int | None:
        seen = Counter(track for t, track in own[person].items() if first <= t <= last)
        return max(seen, key=seen.get) if seen else None

    found = []
    for person in range(truth.people):
        seen = np.flatnonzero(truth.visible_px[:, person] > 0)
        gaps = [(int(a), int(b)) for a, b in pairwise(seen) if times[b] - times[a] >= AWAY_S]
        edges = (
            [(0, gaps[0][0]), *((b, c) for (_, b), (c, _) in pairwise(gaps)), (gaps[-1][1], truth.frames)]
            if gaps
            else []
        )
        for first, then in pairwise(edges):
            others = {mainly(q, 0, then[1]) for q in range(truth.people) if q != person} - {None}
            found.append(Return(mainly(person, *first), mainly(person, *then), frozenset(others)))
    return found


def changes(counts: Sequence[int]) -> int:
    """How often the number of people differs from the one of the frame before."""
    return int((np.diff(counts) != 0).sum())


Ids = Callable[[Sequence[Detections]], list[np.ndarray]]


def rated(clips: Sequence[tuple[Truth, Sequence[Detections]]], give: Ids) -> dict[str, float]:
    """Scores of all clips together; give: ids of the boxes of a clip."""
    frames: list[Frame] = []
    back: list[Return] = []
    people = tracks = shown = true = 0
    seconds = 0.0
    for truth, found in clips:
        ids = give(found)
        own = frames_of(truth, found, ids)
        numbers = {track: k for k, track in enumerate(sorted({int(i) for f in own for i in f.ids}))}
        back += returns(truth, own)
        frames += [
            Frame(f.true_ids + people, np.array([numbers[int(i)] for i in f.ids], int) + tracks, f.iou) for f in own
        ]
        people, tracks = people + truth.people, tracks + len(numbers)
        shown += changes([int((i != NO_ID).sum()) for i in ids])
        true += changes(counted(truth).sum(1).tolist())
        seconds += float(truth.time_ns[-1] - truth.time_ns[0]) / 1e9
    known = [r for r in back if r.before is not None and r.after is not None]
    return {
        **scores(frames),
        "people": people,
        "tracks": tracks,
        "returns": len(known),
        "recognised": sum(r.is_recognised for r in known),
        "mistaken": sum(not r.is_recognised and r.after in r.others for r in known),
        "count_changes_per_min": 60 * shown / max(seconds, 1e-9),
        "true_count_changes_per_min": 60 * true / max(seconds, 1e-9),
    }
