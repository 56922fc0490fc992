/* Measures one start of an app; benchmarks/startup.py runs it several times.
 *
 *   measure_startup            creates a context
 *   measure_startup densepose  also runs a dense pose model (the bundle installed with the library) on one frame
 *
 * Prints {"libraries": ["libc.so.6", ...], "cpu_ms": 2.0}: the shared libraries that are loaded at the end, and the CPU
 * time of all threads since the process began, including the loading of libraries.
 */
#define _GNU_SOURCE
#include <link.h>
#include <maquette/maquette.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

/* Skips the program itself, which has no name here, and the kernel's object, which has no file. */
static int print_library(struct dl_phdr_info* info, size_t size, void* separator) {
  const char* slash = strrchr(info->dlpi_name, '/');
  (void)size;
  if (slash == NULL) return 0;
  printf("%s\"%s\"", *(const char**)separator, slash + 1);
  *(const char**)separator = ", ";
  return 0;
}

static int has_first_result(maq_context* context) {
  maq_densepose* densepose = NULL;
  maq_source* source = NULL;
  maq_frame* frame = NULL;
  maq_densepose_result* result = NULL;
  const int succeeded = maq_densepose_create(context, NULL, &densepose) == MAQ_OK &&
                        maq_source_create(context, "stub:people?count=1", NULL, &source) == MAQ_OK &&
                        maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame) == MAQ_OK &&
                        maq_densepose_run(densepose, frame, &result) == MAQ_OK;
  maq_densepose_result_release(result);
  maq_frame_release(frame);
  maq_source_destroy(source);
  return succeeded; /* the model stays, as in an app */
}

int main(int argc, char** argv) {
  const char* separator = "";
  struct timespec cpu;
  maq_context* context = NULL;
  if (maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK ||
      (argc == 2 && strcmp(argv[1], "densepose") == 0 && !has_first_result(context))) {
    fprintf(stderr, "measure_startup: %s\n", maq_last_error(NULL));
    return 1;
  }
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  printf("{\"libraries\": [");
  dl_iterate_phdr(print_library, &separator);
  printf("], \"cpu_ms\": %.3f}\n", (double)cpu.tv_sec * 1e3 + (double)cpu.tv_nsec / 1e6);
  return 0;
}
