"""Counts of instructions: that they are counted, and what happens when they are not."""

import shutil
import subprocess

import pytest

from benchmarks.processors import instruction_counts
from benchmarks.processors.emulated import OTHERS

LOOP = """
#include <stdio.h>
#include <time.h>
int main(void) {
  struct timespec from, to;
  clock_gettime(CLOCK_MONOTONIC, &from);
  for (int i = 0; i < 1000000; ++i) __asm__ volatile("nop");
  clock_gettime(CLOCK_MONOTONIC, &to);
  printf("%ld\\n", (to.tv_sec - from.tv_sec) * 1000000000L + to.tv_nsec - from.tv_nsec);
  return 0;
}
"""


def case_of(value):
    return {"ms": {stage: {"p50": value} for stage in instruction_counts.STAGES}}


def test_the_clock_of_an_emulated_program_counts_its_instructions(tmp_path):
    if shutil.which("qemu-x86_64") is None:
        pytest.skip("qemu-x86_64 is not installed (scripts/install-packages.sh isa)")
    (avx2,) = (processor for processor in OTHERS if processor.name == "avx2")
    instruction_counts.prepare([avx2])
    source, program = tmp_path / "loop.c", tmp_path / "loop"
    source.write_text(LOOP)
    subprocess.run(["cc", "-O1", "-o", program, source], check=True)
    command = [*instruction_counts.emulated(avx2, tmp_path / "counter"), str(program)]
    counted = int(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
    assert 3_000_000 <= counted < 3_001_000  # nop, decrement, jump


def test_a_table_has_all_stages_and_their_sum():
    found = instruction_counts.millions(case_of(1.5))
    assert found["all"] == 1.5 * len(instruction_counts.STAGES)
    lines = instruction_counts.lines_of({"one": found, "two": found})
    assert lines[0] == "| stage | one | two |"
    assert lines[-1] == "| all | 9.0 | 9.0 |"


def test_a_clock_that_stands_still_is_an_error():
    with pytest.raises(ValueError, match="did not count"):
        instruction_counts.millions(case_of(0.0))
