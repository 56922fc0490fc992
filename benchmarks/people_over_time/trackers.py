"""Two baselines that give ids to boxes: SORT and an association as ByteTrack's.

Both predict boxes by a Kalman filter and match them by IoU with the Hungarian algorithm. Neither looks at the image.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linear_sum_assignment

from benchmarks.people_over_time.kalman import BoxFilter
from benchmarks.people_over_time.metrics import iou_of

NO_ID = -1


@dataclass(eq=False)
class _Track:
    number: int
    filter: BoxFilter
    hits: int = 1
    lost_s: float = 0.0


def _matched(tracks: list[_Track], boxes: np.ndarray, min_iou: float) -> list[tuple[int, int]]:
    """Pairs of a track's and a box's position."""
    if not tracks or not len(boxes):
        return []
    iou = iou_of(np.stack([track.filter.box for track in tracks]), boxes)
    return [(a, b) for a, b in zip(*linear_sum_assignment(-iou), strict=True) if iou[a, b] >= min_iou]


@dataclass(eq=False)
class _Tracker:
    """max_lost_s: after which a track without boxes ends."""

    max_lost_s: float = 1.0
    _tracks: list[_Track] = field(default_factory=list)
    _next: int = 1

    def _predict(self, seconds: float) -> None:
        for track in self._tracks:
            track.filter.predict(seconds)
            track.lost_s += seconds
        self._tracks = [track for track in self._tracks if track.lost_s <= self.max_lost_s + 1e-9]

    def _take(self, track: _Track, box: np.ndarray) -> int:
        track.filter.update(box)
        track.hits, track.lost_s = track.hits + 1, 0.0
        return track.number

    def _begin(self, box: np.ndarray) -> int:
        self._tracks.append(_Track(self._next, BoxFilter(box)))
        self._next += 1
        return self._next - 1


@dataclass(eq=False)
class Sort(_Tracker):
    """SORT (Bewley et al., ICIP 2016). Its first frames of a track are shown, too, so that no box is lost."""

    min_iou: float = 0.3

    def update(self, boxes: np.ndarray, scores: np.ndarray, seconds: float) -> np.ndarray:
        """boxes [N, 4], scores [N]; seconds since the frame before. Returns an id from 1 for each box."""
        self._predict(seconds)
        ids = np.full(len(boxes), NO_ID)
        for a, b in _matched(self._tracks, boxes, self.min_iou):
            ids[b] = self._take(self._tracks[a], boxes[b])
        for b in np.flatnonzero(ids == NO_ID):
            ids[b] = self._begin(boxes[b])
        return ids


@dataclass(eq=False)
class ByteTrack(_Tracker):
    """ByteTrack (Zhang et al., ECCV 2022): boxes with high scores are matched first; those with low scores continue
    tracks and begin none, so that some boxes have no id."""

    high_score: float = 0.6
    new_score: float = 0.7
    min_iou: float = 0.2
    min_iou_low: float = 0.5

    def update(self, boxes: np.ndarray, scores: np.ndarray, seconds: float) -> np.ndarray:
        """As `Sort.update`; NO_ID for a box that is not shown."""
        just_seen = {id(track) for track in self._tracks if track.lost_s == 0}
        self._predict(seconds)
        ids = np.full(len(boxes), NO_ID)
        high, low = np.flatnonzero(scores >= self.high_score), np.flatnonzero(scores < self.high_score)
        pairs = _matched(self._tracks, boxes[high], self.min_iou)
        for a, b in pairs:
            ids[high[b]] = self._take(self._tracks[a], boxes[high[b]])
        taken = {a for a, _ in pairs}
        left = [t for a, t in enumerate(self._tracks) if a not in taken and id(t) in just_seen]
        for a, b in _matched(left, boxes[low], self.min_iou_low):
            ids[low[b]] = self._take(left[a], boxes[low[b]])
        for b in high:
            if ids[b] == NO_ID and scores[b] >= self.new_score:
                ids[b] = self._begin(boxes[b])
        return ids


TRACKERS = {"SORT": Sort, "ByteTrack": ByteTrack}
