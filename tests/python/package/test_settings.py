"""Settings have types for type checkers, enums have names, and wrong ones are told."""

import runpy
import subprocess
import sys
from pathlib import Path

import maquette
import pytest

ROOT = Path(__file__).parents[3]
RIGHT = """
from pathlib import Path
import maquette, numpy as np, PIL.Image
people = maquette.DensePose(long_side_px=384, person_crops="auto", threads=2, bundle_path=Path("a"))
print(people.run(np.zeros((4, 6, 3), np.uint8)).iuv.shape, people.run(Path("a.jpg")))
people.run(PIL.Image.new("L", (1, 1)))
for result in maquette.Pipeline("camera:", maquette.DensePoseModel()):
    print(len(result.people), maquette.Edges().run("a.png", maquette.Intrinsics.centred(4, 3, focal_px=5)).curves.boxes)
maquette.Source("a.mp4", loop=1, queue_length=2)
maquette.HeadBuilder(texture=True, texture_px=512).fit(seconds=3, progress=lambda done, stage: done < 0.5)
maquette.Predictor("sampled").push(maquette.Frame(np.zeros((4, 6, 3), np.uint8)))
maquette.Pipeline("camera:", maquette.EdgesModel(curves=True, curve_settings={"min_length_px": 8}), nice=5)
with maquette.ClipWriter("a.mp4", 30) as clip:
    clip.add("a.png")
"""
WRONG = """
import maquette
maquette.DensePose(long_side=384)
maquette.DensePose(person_crops="some")
maquette.Source("a.mp4", loop="yes")
maquette.Predictor("motoin")
"""


def test_settings_are_the_headers():
    module = runpy.run_path(str(ROOT / "python/write_settings.py"))
    written = module["settings_module"](ROOT / "sdk/include/maquette")
    assert (ROOT / "python/maquette/settings.py").read_text() == written, "run python/write_settings.py"


def checked(program: str, folder: Path) -> list[str]:
    """Returns the lines of mypy about a program of a user."""
    path = folder / "program.py"
    path.write_text(program)
    return mypy("--follow-imports=silent", path)


def mypy(*arguments: object) -> list[str]:
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-warn-return-any", "--no-error-summary",
         "--cache-dir", str(ROOT / "build/mypy"), *arguments],
        capture_output=True, text=True, check=False, env={"MYPYPATH": str(ROOT / "python"), "PATH": ""},
    )  # fmt: skip
    assert not run.stderr, run.stderr
    return run.stdout.splitlines()


def test_a_type_checker_accepts_right_settings_and_refuses_wrong_ones(tmp_path):
    assert checked(RIGHT, tmp_path) == []
    wrong = checked(WRONG, tmp_path)
    assert [int(line.split(":")[1]) for line in wrong if ": error:" in line] == [3, 4, 5, 6], wrong


def test_the_package_itself_has_types():
    assert mypy(ROOT / "python/maquette") == []


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (
            lambda: maquette.DensePose(person_crops="some"),
            ValueError,
            'person_crops is "some"; it is one of default, auto',
        ),
        (lambda: maquette.DensePose(long_side_px="384"), TypeError, "long_side_px is '384'; .* type int32_t"),
        (lambda: maquette.DensePose(threads=2**40), TypeError, "threads is 1099511627776"),
        (lambda: maquette.Predictor("motoin"), ValueError, "auto, last, motion, sampled"),
        (lambda: maquette.Source("stub:pattern").control("zoom"), ValueError, 'control is "zoom"; it is one of auto_e'),
    ],
)
def test_a_wrong_setting_is_told(call, error, text):
    with pytest.raises(error, match=text):
        call()


def test_enums_have_names_and_numbers():
    for crops in ("all", 2):
        with maquette.DensePose(threads=1, person_crops=crops, detail="part") as people:
            result = people.run(maquette.Source("stub:people?count=1&seed=3&size=320x240").read())
        assert result.stats["crop_count"] == 1
        assert not result.u.any()
        assert result.stats["provider"] == "cpu"


def test_the_version_and_the_command_line():
    assert maquette.__version__ == maquette.build_info()["version"]
    run = subprocess.run(
        [sys.executable, "-m", "maquette", "--version"], capture_output=True, text=True, check=False,
        env={"PYTHONPATH": str(ROOT / "python")},
    )  # fmt: skip
    assert run.stdout == f"maquette {maquette.__version__}\n"
