/* Prints what stands out in a clip or a camera: surprise video:clip.mp4 [<bundle>] */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_surprise_config config;
  maq_surprise_score score = {0};
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_surprise* surprise = NULL;
  maq_frame* frame = NULL;
  maq_status status;
  int frames = 0;
  if (argc < 2) {
    fprintf(stderr, "usage: surprise <source> [<bundle for prediction>]\n");
    return 2;
  }
  maq_surprise_config_init(&config, sizeof config);
  config.bundle_path = argc > 2 ? argv[2] : NULL;
  score.struct_size = sizeof score;
  status = maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
  if (status == MAQ_OK) status = maq_source_create(context, argv[1], NULL, &source);
  if (status == MAQ_OK) status = maq_surprise_create(context, &config, &surprise);
  while (status == MAQ_OK) {
    status = maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
    if (status != MAQ_OK) break;
    status = maq_surprise_push(surprise, frame, &score);
    maq_frame_release(frame);
    if (status == MAQ_OK && score.is_event) {
      printf("frame %d: %s, %.1f times as surprising as before\n", frames, score.is_cut ? "a cut" : "an event",
             score.ratio);
    }
    ++frames;
  }
  if (status != MAQ_END_OF_STREAM) fprintf(stderr, "%s\n", maq_last_error(NULL));
  printf("%d frames\n", frames);
  maq_surprise_destroy(surprise), maq_source_destroy(source), maq_context_destroy(context);
  return status != MAQ_END_OF_STREAM;
}
