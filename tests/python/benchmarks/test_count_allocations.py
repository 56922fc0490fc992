"""The preloaded counter counts heap allocations between two frames, and names those of ONNX Runtime."""

import json
import subprocess

from benchmarks import cameras

PROGRAM = """
#include <maquette/source.h>
#include <stdlib.h>
maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame);
void run_network(void);
int main(void) {
  for (int i = 1; i <= 40; ++i) {
    if (i == 25) run_network();
    void* volatile taken = i % 5 == 0 ? malloc(100) : NULL; /* before frames 5, 10, 15 ... */
    void* volatile aligned = i == 22 ? aligned_alloc(64, 128) : NULL;
    maq_frame* frame = NULL;
    while (maq_source_acquire_frame(NULL, 0, &frame) != MAQ_OK) continue;
    taken = i == 23 ? realloc(taken, 200) : taken;
    free(taken);
    free(aligned);
  }
  return 0;
}
"""
# Every second call times out: only frames count.
LIBRARY = """
#include <maquette/source.h>
maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame) {
  static int calls;
  (void)source, (void)timeout_ns, (void)frame;
  return ++calls % 2 ? MAQ_TIMEOUT : MAQ_OK;
}
"""


RUNTIME = """
#include <stdlib.h>
void run_network(void) {
  void* volatile taken = malloc(10);
  free(taken);
  taken = calloc(2, 5);
  free(taken);
}
"""


def test_allocations_between_two_frames_are_counted(tmp_path):
    def compiled(name, *arguments):
        command = ["cc", "-std=c11", "-O1", "-fno-builtin", "-Isdk/include", "-o", str(tmp_path / name), *arguments]
        subprocess.run([str(x) for x in command], check=True)
        return str(tmp_path / name)

    (tmp_path / "p.c").write_text(PROGRAM)
    (tmp_path / "l.c").write_text(LIBRARY)
    library = compiled("libsource.so", "-shared", "-fPIC", tmp_path / "l.c")
    (tmp_path / "r.c").write_text(RUNTIME)
    runtime = compiled("libonnxruntime.so", "-shared", "-fPIC", tmp_path / "r.c")
    program = compiled("program", tmp_path / "p.c", library, runtime, f"-Wl,-rpath,{tmp_path}")
    counter = compiled("count.so", "-shared", "-fPIC", cameras.COUNTER)
    count = tmp_path / "count.json"
    environment = {"LD_PRELOAD": counter, "COUNT_FROM": "10", "COUNT_TO": "30", "COUNT_FILE": str(count)}
    run = subprocess.run([program], check=True, capture_output=True, text=True, env=environment)
    # Before frames 15, 20, 25 and 30, the aligned one, and the one that grows.
    assert json.loads(count.read_text()) == {"frames": 20, "allocations": 8, "of_onnxruntime": 2}
    assert run.stderr.count("allocation in steady state") == 5
    subprocess.run([program], check=True, capture_output=True, env=environment | {"COUNT_TO": "24"})
    assert json.loads(count.read_text()) == {"frames": 14, "allocations": 4, "of_onnxruntime": 0}
    own = subprocess.run(
        [program], check=True, capture_output=True, text=True,
        env=environment | {"COUNT_FROM": "24", "COUNT_OWN": "1"},
    )  # fmt: skip
    assert json.loads(count.read_text()) == {"frames": 6, "allocations": 4, "of_onnxruntime": 2}
    assert own.stderr.count("allocation in steady state") == 2
