/* Prints the people that a camera sees, until Ctrl-C: live [<source>]. The library captures and computes on its own
 * thread, and drops frames that come meanwhile. */
#include <maquette/maquette.h>
#include <signal.h>
#include <stdio.h>

static volatile sig_atomic_t is_asked_to_stop = 0;

static void ask_to_stop(int signal_number) {
  (void)signal_number;
  is_asked_to_stop = 1;
}

int main(int argc, char** argv) {
  const int64_t a_moment_ns = 100000000;
  maq_context* context = NULL;
  maq_model* model = NULL;
  maq_pipeline* pipeline = NULL;
  maq_status status = maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
  signal(SIGINT, ask_to_stop);
  if (status == MAQ_OK) status = maq_densepose_model_create(context, NULL, &model);
  if (status == MAQ_OK) status = maq_pipeline_create(context, NULL, &pipeline);
  if (status == MAQ_OK) status = maq_pipeline_set_model(pipeline, model);
  if (status == MAQ_OK) status = maq_pipeline_set_source(pipeline, argc > 1 ? argv[1] : "camera:");
  while (status == MAQ_OK && !is_asked_to_stop) {
    maq_pipeline_result* result = NULL;
    maq_pipeline_result_stats stats = {sizeof stats};
    status = maq_pipeline_acquire_result(pipeline, a_moment_ns, &result);
    if (status == MAQ_TIMEOUT) status = MAQ_OK; /* look for Ctrl-C, and wait on */
    if (result == NULL) continue;
    maq_pipeline_result_get_stats(result, &stats);
    printf("%u people, %.0f ms\n", maq_densepose_result_get_person_count(maq_pipeline_result_get_densepose(result)),
           stats.run_ms);
    maq_pipeline_result_release(result);
  }
  if (status == MAQ_END_OF_STREAM) status = MAQ_OK;
  if (status != MAQ_OK) fprintf(stderr, "%s\n", maq_last_error(NULL));
  maq_pipeline_destroy(pipeline), maq_model_destroy(model), maq_context_destroy(context);
  return status != MAQ_OK;
}
