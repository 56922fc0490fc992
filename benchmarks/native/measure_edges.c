/* Runs a stream of depth frames through the edge network, like an app (benchmarks/edges/speed.py):
 *
 *   measure_edges BUNDLE URI FRAMES THREADS
 *
 * prints {"memory_mb": 30.1}: the peak memory that the network and its stream add to the process. With
 * benchmarks/count_allocations.c preloaded, the heap allocations of a frame are counted too. */
#include <maquette/maquette.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Returns the peak of this program alone; getrusage() begins with the peak of its parent process. */
static double peak_mb(void) {
  char line[128];
  double kib = 0;
  FILE* file = fopen("/proc/self/status", "r");
  while (file != NULL && fgets(line, sizeof line, file) != NULL) {
    if (strncmp(line, "VmHWM:", 6) == 0) kib = strtod(line + 6, NULL);
  }
  if (file != NULL) fclose(file);
  return kib * 1024e-6;
}

static maq_status run_frame(maq_edges* edges, maq_source* source) {
  maq_frame* frame = NULL;
  maq_edges_result* result = NULL;
  maq_status status = maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
  if (status == MAQ_OK && edges != NULL) status = maq_edges_run(edges, frame, &result);
  maq_edges_result_release(result);
  maq_frame_release(frame);
  return status;
}

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_edges* edges = NULL;
  maq_edges_config config;
  double before_mb = 0;
  int count;
  maq_status status;
  if (argc != 5) {
    fprintf(stderr, "usage: measure_edges BUNDLE URI FRAMES THREADS\n");
    return 2;
  }
  status = maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
  if (status == MAQ_OK) status = maq_source_create(context, argv[2], NULL, &source);
  if (status == MAQ_OK) status = run_frame(NULL, source); /* the source's own memory */
  before_mb = peak_mb();
  if (status == MAQ_OK) status = maq_edges_config_init(&config, sizeof config);
  if (status == MAQ_OK) {
    config.model.bundle_path = argv[1];
    config.model.threads = atoi(argv[4]);
    status = maq_edges_create(context, &config, &edges);
  }
  for (count = atoi(argv[3]); status == MAQ_OK && count > 0; --count) status = run_frame(edges, source);
  if (status != MAQ_OK) fprintf(stderr, "measure_edges: %s\n", maq_last_error(NULL));
  printf("{\"memory_mb\": %.3f}\n", peak_mb() - before_mb);
  maq_edges_destroy(edges);
  maq_source_destroy(source);
  maq_context_destroy(context);
  return status == MAQ_OK ? 0 : 1;
}
