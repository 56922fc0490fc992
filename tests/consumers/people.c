/* Prints the people of one image: people <bundle> <source>. The smallest program that uses Maquette. */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_densepose* densepose = NULL;
  maq_frame* frame = NULL;
  maq_densepose_result* result = NULL;
  const maq_person* people = NULL;
  uint32_t count = 0, i;
  maq_densepose_config config;
  maq_densepose_config_init(&config, sizeof config);
  config.bundle_path = argc == 3 ? argv[1] : NULL;
  int failed = maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK ||
               maq_densepose_create(context, &config, &densepose) != MAQ_OK ||
               maq_source_create(context, argv[2], NULL, &source) != MAQ_OK ||
               maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame) != MAQ_OK ||
               maq_densepose_run(densepose, frame, &result) != MAQ_OK ||
               maq_densepose_result_get_people(result, &people, &count) != MAQ_OK;
  if (failed)
    fprintf(stderr, "%s\n", maq_get_last_error(frame ? (void*)densepose : source ? (void*)source : (void*)context));
  for (i = 0; i < count; ++i)
    printf("person %.2f at x %.0f y %.0f\n", people[i].score, people[i].box_px[0], people[i].box_px[1]);
  maq_densepose_result_release(result), maq_frame_release(frame);
  maq_source_destroy(source), maq_densepose_destroy(densepose), maq_context_destroy(context);
  return failed;
}
