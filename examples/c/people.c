/* Prints the people of one image: people <source>. The smallest program that uses Maquette. */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_densepose* densepose = NULL;
  maq_frame* frame = NULL;
  maq_densepose_result* result = NULL;
  uint32_t i;
  int failed = maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK ||
               maq_densepose_create(context, NULL, &densepose) != MAQ_OK ||
               maq_source_create(context, argc == 2 ? argv[1] : NULL, NULL, &source) != MAQ_OK ||
               maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame) != MAQ_OK ||
               maq_densepose_run(densepose, frame, &result) != MAQ_OK;
  if (failed) fprintf(stderr, "%s\n", maq_last_error(NULL));
  for (i = 0; i < maq_densepose_result_get_person_count(result); ++i) {
    maq_densepose_person person = {sizeof person};
    maq_densepose_result_get_person(result, i, &person);
    printf("person %.2f at x %.0f y %.0f\n", person.score, person.box_px[0], person.box_px[1]);
  }
  maq_densepose_result_release(result), maq_frame_release(frame);
  maq_source_destroy(source), maq_densepose_destroy(densepose), maq_context_destroy(context);
  return failed;
}
