"""Who goes where and when in a clip: people walk across, leave and come back, stand, turn, stoop, sit down.

World: z up, the ground at z = 0, metres; the camera stands near (0, 0) and looks towards +y. A yaw of 0 faces -y.
Plans are drawn until one has what a clip is for (`fault_of`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from export.people.clips.gait import Cycle

STEP_S = 1 / 60
_TURN_RATE = 2.8  # radians a second
_BLEND_S, _BEND_S = 0.35, 0.9  # from standing to walking; to the ground or onto a seat
_ARRIVED_M = 0.12
_APART_M, _NEAR_M = 0.62, 1.9  # between two people; to the camera
_EDGE_M = 0.25  # half of a body's width
AWAY_S = 2.0  # a person who is out of view for so long and comes back


@dataclass(frozen=True)
class Walk:
    x: float
    y: float


@dataclass(frozen=True)
class Stay:
    """yaw: where to look (None: as before); bends: stoops or sits down meanwhile."""

    seconds: float
    yaw: float | None = None
    bends: bool = False


@dataclass(frozen=True)
class Role:
    """pace: of the walk, 1 as in its motion clip. kind: what a bend is, "stoop" or "sit"."""

    name: str
    start: tuple[float, float]
    yaw: float
    moves: tuple[Walk | Stay, ...]
    pace: float
    kind: str = "stoop"
    bent: bool = False  # at the start


@dataclass(frozen=True, eq=False)
class Track:
    """place [T, 2]; yaw [T], radians; phase [T]: time in the walking cycle, seconds; walks, bends [T]: 0 to 1."""

    place: np.ndarray
    yaw: np.ndarray
    phase: np.ndarray
    walks: np.ndarray
    bends: np.ndarray


def _turned(angle: float) -> float:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def yaw_towards(dx: float, dy: float) -> float:
    return float(np.arctan2(dx, -dy))


def track_of(role: Role, walk: Cycle, seconds: np.ndarray, phase: float) -> Track:
    """Follows the moves of a role in steps of 1/60 s; afterwards the person stands."""
    x, y = role.start
    yaw, walks, bends = role.yaw, 0.0, float(role.bent)
    moves, spent = list(role.moves), 0.0
    if moves and isinstance(moves[0], Walk):
        walks, yaw = 1.0, yaw_towards(moves[0].x - x, moves[0].y - y)
    rows = []
    for _ in range(int(np.ceil(seconds[-1] / STEP_S)) + 2):
        rows.append((x, y, yaw, phase, walks, bends))
        move = moves[0] if moves else Stay(np.inf)
        wanted, bend, face = 0.0, 0.0, yaw
        if isinstance(move, Walk):
            dx, dy = move.x - x, move.y - y
            face = yaw_towards(dx, dy)
            wanted = float(abs(_turned(face - yaw)) < 0.9 and bends < 0.05)
            if np.hypot(dx, dy) < _ARRIVED_M:
                moves.pop(0)
        else:
            face = yaw if move.yaw is None else move.yaw
            bend = float(move.bends and walks < 0.05 and spent < move.seconds - _BEND_S)
            spent += STEP_S
            if spent >= move.seconds:
                moves.pop(0)
                spent = 0.0
        if bends < 0.05:  # nobody turns on a seat
            yaw += float(np.clip(_turned(face - yaw), -_TURN_RATE * STEP_S, _TURN_RATE * STEP_S))
        walks += float(np.clip(wanted - walks, -STEP_S / _BLEND_S, STEP_S / _BLEND_S))
        bends += float(np.clip(bend - bends, -STEP_S / _BEND_S, STEP_S / _BEND_S))
        ahead = walks * role.pace * walk.speed_at(phase) * STEP_S
        x, y = x + ahead * np.sin(yaw), y - ahead * np.cos(yaw)
        phase += walks * role.pace * STEP_S
    table = np.array(rows)
    table[:, 2] = np.unwrap(table[:, 2])
    at = np.arange(len(table)) * STEP_S
    x, y, yaw, phase, walks, bends = (np.interp(seconds, at, column) for column in table.T)
    smooth = bends**2 * (3 - 2 * bends)
    return Track(np.stack([x, y], 1), yaw, phase, walks, smooth)


def draw_roles(rng: np.random.Generator, count: int, half_view: float, seconds: float) -> list[Role]:
    """half_view: tangent of half the angle that the camera ever shows to one side."""
    u = rng.uniform
    depths = np.sort(u(2.6, 7.2, count))
    names = ["returns", *map(str, rng.choice(["crosses", "returns", "stays", "sits", "approaches"], count - 1))]
    if count > 1 and "crosses" not in names:
        names[1] = "crosses"
    roles = []
    for name, depth in zip(names, rng.permutation(depths), strict=True):
        depth = min(depth, u(2.6, 4.2)) if name == "returns" else depth
        edge, side = depth * half_view, rng.choice([-1.0, 1.0])
        pace = u(0.85, 1.25)
        out = (side * (edge + u(0.6, 1.0)), depth + u(-0.3, 0.3))
        if name == "crosses":
            start = (-side * edge * u(0.2, 1.15), depth)
            moves: list[Walk | Stay] = [Walk(*out)]
            if u() < 0.35:
                moves.insert(0, Walk(u(-0.5, 0.5) * edge, depth))
                moves.insert(1, Stay(u(0.5, 1.5), rng.normal(0, 0.6)))
            moves += [Stay(u(1.0, 2.5)), Walk(-side * edge * u(0, 1), depth + u(-0.4, 0.4))]
            roles.append(Role(name, start, 0.0, tuple(moves), pace))
        elif name == "returns":
            start = (side * edge * u(0.0, 0.75), depth)
            first = [Stay(u(0.2, 1.5))] if u() < 0.5 else []
            inside = (side * edge * u(-0.6, 0.6), depth + u(-0.6, 0.6))
            moves = [*first, Walk(*out), Stay(u(1.2, 2.4)), Walk(*inside), Stay(u(0.5, 2.0), rng.normal(0, 0.8))]
            roles.append(Role(name, start, rng.normal(0, 1.0), tuple(moves), pace))
        elif name == "approaches":
            far, near = (u(-0.6, 0.6) * 7, u(6.5, 8.5)), (u(-0.3, 0.3) * 3, u(2.5, 3.8))
            ends = [far, near] if u() < 0.5 else [near, far]
            moves = [Walk(*ends[1]), Stay(u(0.3, 1.0)), Walk(*ends[0])]
            roles.append(Role(name, ends[0], 0.0, tuple(moves), pace))
        else:
            start = (u(-0.75, 0.75) * edge, depth)
            about = rng.normal(0, 0.7)
            sits = name == "sits"
            waits = u(0.2, 0.35) * seconds
            moves = [Stay(waits, None, sits and u() < 0.5), Stay(u(2.6, 4.0), None, True)]
            if u() < 0.6:
                moves += [
                    Stay(u(0.8, 1.5), about + np.pi * (not sits)),
                    Walk(start[0] + side * u(0.8, 2.5), depth - 0.2),
                ]
            bent = isinstance(moves[0], Stay) and moves[0].bends
            roles.append(Role(name, start, about, tuple(moves), pace, "sit" if sits else "stoop", bent))
    return roles


def in_view(place: np.ndarray, yaw: np.ndarray, half_view: float) -> np.ndarray:
    """Whether a camera sees bodies at [N, T, 2]. yaw [T]: radians to the left; half_view: as in `CameraPath`."""
    x = place[..., 0] * np.cos(yaw) + place[..., 1] * np.sin(yaw)
    depth = -place[..., 0] * np.sin(yaw) + place[..., 1] * np.cos(yaw)
    return (depth > 0.5) & (np.abs(x) - _EDGE_M < depth * half_view)


def longest_absence(seen: np.ndarray) -> int:
    """Frames of the longest time [T] out of view between two times in view."""
    at = np.flatnonzero(seen)
    return int(np.diff(at).max(initial=1)) - 1 if len(at) > 1 else 0


def fault_of(
    tracks: Sequence[Track], seats: Sequence[tuple[int, np.ndarray]], seen: np.ndarray, seconds: np.ndarray
) -> str:
    """Why a plan is not used, "" if it is: people keep apart, pass each other in view, and one comes back after 2 s.

    seats: whose it is, and its place [2]; seen: bool [N, T].
    """
    places = np.stack([t.place for t in tracks])
    if (np.hypot(*np.moveaxis(places, -1, 0)) < _NEAR_M).any():
        return "somebody is too near to the camera"
    bearing = np.arctan2(places[..., 0], places[..., 1])
    crossings = 0
    for a in range(len(places)):
        for b in range(a):
            if np.linalg.norm(places[a] - places[b], axis=-1).min() < _APART_M:
                return "two people touch"
            both = seen[a] & seen[b]
            crossings += int((np.diff(bearing[a] > bearing[b]) & both[1:] & both[:-1]).sum())
    for owner, seat in seats:
        others = [k for k in range(len(places)) if k != owner]
        if (np.linalg.norm(places[others] - seat, axis=-1) < _APART_M + 0.15).any():
            return "somebody walks into a seat"
    if not crossings:
        return "nobody passes anybody"
    away = max(longest_absence(row) for row in seen) * (seconds[1] - seconds[0])
    if away < AWAY_S + 0.1:
        return "nobody comes back"
    if seen.any(1).sum() < len(seen) or seen.mean() < 0.4:
        return "too few people are seen"
    return ""
