/* Counts the heap allocations of a program between two frames of a source (benchmarks/cameras.py).
 *
 *   cc -shared -fPIC -O2 -I sdk/include -o count_allocations.so benchmarks/count_allocations.c
 *   LD_PRELOAD=./count_allocations.so COUNT_FROM=200 COUNT_TO=1200 COUNT_FILE=count.json \
 *       maquette play 'stub:pattern?live=1&fps=400' --frames 1200 --no-image
 *
 * writes {"frames": 1000, "allocations": 0, "of_onnxruntime": 0} when frame 1200 is taken: allocations of all threads
 * since frame 200, and those by ONNX Runtime (its code, rather than the SDK's, is the nearest caller of the two). The
 * stacks of the first ones go to standard error, for `addr2line -Cfe` of a library with symbols; COUNT_OWN=1 leaves out
 * the stacks of ONNX Runtime. Needs glibc.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <maquette/source.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { STACKS_SHOWN = 5, STACK_DEPTH = 16 };

/* glibc's own names of its functions, which are needed before dlsym() could find them: it allocates itself. */
extern void* __libc_malloc(size_t bytes);
extern void* __libc_calloc(size_t count, size_t bytes);
extern void* __libc_realloc(void* old, size_t bytes);
extern void* __libc_memalign(size_t alignment, size_t bytes);

static atomic_bool counting;
static atomic_bool shows_own_only;
static atomic_long allocations, of_onnxruntime, shown;
static _Thread_local bool is_showing; /* a stack, which may allocate */

/* Returns whether ONNX Runtime, rather than the SDK, is the nearest caller of the two. */
static bool is_onnxruntime(void* const* stack, int depth) {
  for (int i = 0; i < depth; ++i) {
    Dl_info info;
    if (dladdr(stack[i], &info) == 0 || info.dli_fname == NULL) continue;
    if (strstr(info.dli_fname, "libonnxruntime") != NULL) return true;
    if (strstr(info.dli_fname, "libmaquette") != NULL) return false;
  }
  return false;
}

static void count(void) {
  void* stack[STACK_DEPTH];
  int depth;
  bool is_theirs;
  if (!atomic_load(&counting) || is_showing) return;
  is_showing = true;
  atomic_fetch_add(&allocations, 1);
  depth = backtrace(stack, STACK_DEPTH);
  is_theirs = is_onnxruntime(stack, depth);
  if (is_theirs) atomic_fetch_add(&of_onnxruntime, 1);
  if (!(is_theirs && atomic_load(&shows_own_only)) && atomic_fetch_add(&shown, 1) < STACKS_SHOWN) {
    dprintf(STDERR_FILENO, "allocation in steady state:\n");
    backtrace_symbols_fd(stack, depth, STDERR_FILENO);
  }
  is_showing = false;
}

void* malloc(size_t bytes) {
  count();
  return __libc_malloc(bytes);
}

void* calloc(size_t number, size_t bytes) {
  count();
  return __libc_calloc(number, bytes);
}

void* realloc(void* old, size_t bytes) {
  count();
  return __libc_realloc(old, bytes);
}

void* memalign(size_t alignment, size_t bytes) {
  count();
  return __libc_memalign(alignment, bytes);
}

void* aligned_alloc(size_t alignment, size_t bytes) { return memalign(alignment, bytes); }

int posix_memalign(void** out, size_t alignment, size_t bytes) {
  void* found = memalign(alignment, bytes);
  if (found == NULL) return ENOMEM;
  *out = found;
  return 0;
}

static long number(const char* name) {
  const char* text = getenv(name);
  return text == NULL ? -1 : atol(text);
}

static void write_count(long frames) {
  char text[128];
  const char* path = getenv("COUNT_FILE");
  const int length = snprintf(text, sizeof text, "{\"frames\": %ld, \"allocations\": %ld, \"of_onnxruntime\": %ld}\n",
                              frames, atomic_load(&allocations), atomic_load(&of_onnxruntime));
  const int file = path == NULL ? STDOUT_FILENO : open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0 || write(file, text, (size_t)length) != length) {
    dprintf(STDERR_FILENO, "count_allocations: %s cannot be written: %s\n", path, strerror(errno));
  }
  if (file > STDERR_FILENO) close(file);
}

/* Replaces the function of the library; one thread of the program takes frames. */
maq_status maq_source_acquire_frame(maq_source* source, int64_t timeout_ns, maq_frame** frame) {
  static maq_status (*real)(maq_source*, int64_t, maq_frame**);
  static long taken, from, to;
  maq_status status;
  if (real == NULL) {
    void* stack[STACK_DEPTH];
    *(void**)&real = dlsym(RTLD_NEXT, "maq_source_acquire_frame");
    from = number("COUNT_FROM");
    to = number("COUNT_TO");
    atomic_store(&shows_own_only, number("COUNT_OWN") > 0);
    backtrace(stack, STACK_DEPTH); /* loads what it needs */
  }
  status = real(source, timeout_ns, frame);
  if (status != MAQ_OK) return status;
  ++taken;
  if (taken == from) atomic_store(&counting, true);
  if (taken == to && atomic_exchange(&counting, false)) write_count(to - from);
  return status;
}
