"""Scripts that are no part of the SDK."""

import subprocess
import sys
from pathlib import Path

WITH_AMX = Path(__file__).parents[3] / "scripts/with-amx.sh"


def with_amx(*command: str) -> subprocess.CompletedProcess:
    return subprocess.run([WITH_AMX, *command], capture_output=True, text=True)


def test_with_amx_multiplies_in_bfloat16_or_says_that_it_cannot():
    program = "import faulthandler as f, torch; f.enable(); a = torch.ones(64, 64).bfloat16(); print((a @ a)[0, 0])"
    ran = with_amx(sys.executable, "-c", program)
    if "amx_bf16" in Path("/proc/cpuinfo").read_text().split():
        assert (ran.returncode, ran.stdout.split("(")[1][:3]) == (0, "64."), ran.stderr
    else:
        assert ran.returncode == 1
        assert "no AMX" in ran.stderr


def test_with_amx_teaches_and_hides_no_crash():
    assert "torchrun" in with_amx("--help").stdout
    if "amx_bf16" in Path("/proc/cpuinfo").read_text().split():
        assert with_amx(sys.executable, "-c", "import ctypes; ctypes.string_at(0)").returncode < 0


def test_training_from_a_pack_says_what_it_needs():
    script = WITH_AMX.with_name("train-from-pack.sh")
    said = subprocess.run([script], capture_output=True, text=True)
    assert said.returncode == 2
    assert all(f"train-from-pack.sh {command}" in said.stdout for command in ("render", "crops", "both"))
    assert "PERCENT" in said.stdout
    assert subprocess.run([script, "render"], capture_output=True, text=True).returncode == 2


def test_training_with_a_pack_of_photographs_says_what_it_needs():
    script = WITH_AMX.with_name("train-people.sh")
    said = subprocess.run([script], capture_output=True, text=True)
    assert said.returncode == 2
    assert all(f"train-people.sh {command}" in said.stdout for command in ("label", "render", "train"))
    assert all(name in said.stdout for name in ("WORK", "MINUTES", "IMAGES", "COMPOSED", "PROCESSES", "CAP"))
    assert subprocess.run([script, "label"], capture_output=True, text=True).returncode == 2
