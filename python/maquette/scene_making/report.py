"""The report about a scene: the return value of `make_scene`, as JSON and as text."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from maquette.scene_making.photos import LeftOut
from maquette.scene_making.preview import Compared
from maquette.scene_making.work_folder import write_atomically

_SHOWN = 20  # photos left out, in the text


@dataclass(frozen=True)
class SceneReport:
    """scene, preview, capture: paths of the results. found: photos or frames looked at; used: of these, photos that
    were matched; posed: of these, photos with a camera. left_out: photos that were not used, and why. compared: photos
    beside the scene's views. seconds: of each stage, also if an earlier run ended it. notes: sentences for the user."""

    source: str
    scene: str
    preview: str
    capture: str
    found: int
    used: int
    posed: int
    left_out: list[LeftOut]
    notes: list[str]
    mapper: str
    reprojection_error_px: float
    sparse_points: int
    cloud_points: int
    scene_points: int
    scene_bytes: int
    compared: list[Compared]
    seconds: dict[str, float]

    @property
    def psnr_db(self) -> float | None:
        """Mean over held-out photos; None without any."""
        values = [view.psnr_db for view in self.compared if view.held_out]
        return sum(values) / len(values) if values else None

    def to_json(self) -> dict[str, Any]:
        total = sum(self.seconds.values())
        return {"version": 1, **asdict(self), "psnr_db": self.psnr_db, "unit": "unknown", "seconds_total": total}

    def text(self) -> str:
        held_out = [view for view in self.compared if view.held_out]
        lines = [
            f"{self.scene}: {self.scene_points} points, {self.scene_bytes / 1e6:.1f} MB, from {self.source}",
            f"  photos    {self.found} found, {self.used} matched, {self.posed} with a camera "
            f"({self.mapper}; mean error {self.reprojection_error_px:.2f} px)",
        ]
        if held_out:
            each = ", ".join(f"{view.psnr_db:.1f}" for view in held_out)
            photos = "photo" if len(held_out) == 1 else "photos"
            lines.append(f"  quality   {self.psnr_db:.1f} dB PSNR on {len(held_out)} held-out {photos} ({each})")
        else:
            lines.append("  quality   not measured: with fewer than 6 photos none is held out")
        stages = ", ".join(f"{name} {value:.1f}" for name, value in self.seconds.items())
        lines.append(f"  seconds   {sum(self.seconds.values()):.1f}: {stages}")
        lines.append(
            "  unit      unknown: photos alone do not tell metres; the cameras' mean distance from their middle is 1"
        )
        lines += [f"  note      {note}" for note in self.notes]
        lines += [f"  left out  {entry.name}: {entry.reason}" for entry in self.left_out[:_SHOWN]]
        if len(self.left_out) > _SHOWN:
            lines.append(f"  left out  {len(self.left_out) - _SHOWN} more, in the JSON file")
        lines.append(f"  preview   {self.preview}: photos on the left, the scene on the right")
        lines.append(f"  capture   {self.capture}: photos, cameras and points that the scene was built from")
        return "\n".join(lines)

    def save(self, stem: Path) -> None:
        """Writes STEM.json and STEM.txt. Raises OSError."""
        write_atomically(stem.with_name(stem.name + ".json"), json.dumps(self.to_json(), indent=1) + "\n")
        write_atomically(stem.with_name(stem.name + ".txt"), self.text() + "\n")
